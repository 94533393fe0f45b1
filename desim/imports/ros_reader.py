"""Reading of recordings of ROS tools: MCAP files, bags of ROS 1, folders of ROS 2 bags."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator
from pathlib import Path
from typing import BinaryIO

from mcap.records import Channel, Chunk, McapRecord, Schema
from mcap.records import Message as McapMessage
from mcap.stream_reader import StreamReader, breakup_chunk
from rosbags.highlevel import AnyReader
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from desim.errors import InputError, described
from desim.export.ros.message_types import TopicMessage
from desim.files import opened

_MCAP, _BAG = b"\x89MCAP0\r\n", b"#ROSBAG V"
_METADATA = "metadata.yaml"  # of a bag of ROS 2
_BAD_INDEX = re.compile("Bag is not indexed|Bag index looks damaged")  # rosbags says so
_ALLOWED = "allowed: an .mcap file, a .bag file of ROS 1, the folder of a bag of ROS 2"
_ENCODINGS = {"cdr": "ros2msg", "ros1": "ros1msg"}  # of messages, and of their definitions


class RosRecording:
    """A recording of ROS. While ``messages`` goes on, ``topics`` (all topics and their types)
    grows; ``broken`` then says what is wrong with a file of which not all could be read.

    Raises ``InputError`` for a file that cannot be read at all.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.topics: dict[str, str] = {}
        self.broken: str | None = None
        self.count = 0
        if path.is_dir() and not (path / _METADATA).is_file():
            raise InputError(f"{path}: is no folder of a bag of ROS 2: it has no {_METADATA}; "
                             f"{_ALLOWED}")
        self._is_mcap = not path.is_dir() and self._begins() == _MCAP

    def messages(self, kinds: Collection[str]) -> Iterator[TopicMessage]:
        """The messages of these types, in the order of the file. Raises ``InputError`` where there
        is none that can be read."""
        try:
            for read in self._mcap(kinds) if self._is_mcap else self._bag(kinds):
                self.count += 1
                yield read
        except Exception as error:  # of any of the libraries below, at any damaged byte
            self.broken = described(error)
        if self.broken and not self.count:
            advice = "; rosbag reindex may mend it" if _BAD_INDEX.search(self.broken) else ""
            raise InputError(f"{self.path}: damaged: {self.broken}{advice}")

    def _begins(self) -> bytes:
        try:
            with opened(self.path) as file:
                start = file.read(16)
        except OSError as error:
            raise InputError(f"{self.path}: {error.strerror or error}") from error
        if not start:
            raise InputError(f"{self.path}: is empty")
        for magic in (_MCAP, _BAG):
            if start.startswith(magic):
                return magic
        raise InputError(f"{self.path}: is neither an MCAP file nor a bag of ROS; {_ALLOWED}")

    def _mcap(self, kinds: Collection[str]) -> Iterator[TopicMessage]:
        """Record by record, so that a file that was cut short is read up to there."""
        store = get_typestore(Stores.EMPTY)
        schemas: dict[int, Schema] = {}
        channels: dict[int, tuple[str, str, str] | None] = {}
        with opened(self.path) as file:
            for record in self._records(file):
                if isinstance(record, Schema):
                    schemas[record.id] = record
                elif isinstance(record, Channel) and record.id not in channels:
                    schema = schemas.get(record.schema_id)
                    self.topics[record.topic] = schema.name if schema else record.message_encoding
                    known = schema is not None and schema.name in kinds and \
                        schema.encoding == _ENCODINGS.get(record.message_encoding)
                    channels[record.id] = None
                    if schema is not None and known:
                        store.register({name: fields for name, fields in get_types_from_msg(
                            schema.data.decode(), schema.name).items()
                            if name not in store.fielddefs})
                        channels[record.id] = record.topic, schema.name, record.message_encoding
                elif isinstance(record, McapMessage) and (
                        channel := channels.get(record.channel_id)):
                    topic, kind, encoding = channel
                    read = store.deserialize_cdr if encoding == "cdr" else store.deserialize_ros1
                    yield TopicMessage(record.log_time, topic, kind, read(record.data, kind))

    def _records(self, file: BinaryIO) -> Iterator[McapRecord]:
        """All records. A chunk with wrong bytes is left out."""
        for record in StreamReader(file, emit_chunks=True).records:
            if not isinstance(record, Chunk):
                yield record
                continue
            try:
                inside = breakup_chunk(record, validate_crc=True)
            except Exception as error:  # of zstandard, lz4, struct, and whatever they call
                self.broken = described(error)
                continue
            yield from inside

    def _bag(self, kinds: Collection[str]) -> Iterator[TopicMessage]:
        with AnyReader([self.path], default_typestore=get_typestore(Stores.LATEST)) as reader:
            self.topics |= {one.topic: one.msgtype for one in reader.connections}
            wanted = [one for one in reader.connections if one.msgtype in kinds]
            for one, time_ns, data in reader.messages(wanted) if wanted else ():
                yield TopicMessage(time_ns, one.topic, one.msgtype,
                                   reader.deserialize(data, one.msgtype))
