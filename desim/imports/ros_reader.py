"""Reading of recordings of ROS tools: MCAP files, bags of ROS 1, folders of ROS 2 bags."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator
from dataclasses import replace
from pathlib import Path
from typing import BinaryIO

from mcap.opcode import Opcode
from mcap.records import Channel, Chunk, McapRecord, Schema
from mcap.records import Message as McapMessage
from mcap.stream_reader import StreamReader, get_chunk_data_stream
from rosbags.highlevel import AnyReader
from rosbags.interfaces import Nodetype
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from rosbags.typesys.store import Typestore

from desim.errors import InputError, described
from desim.export.ros.message_types import TopicMessage
from desim.files import opened
from desim.imports import bag_folder, unpacked_parts
from desim.imports.unpacked_parts import DECOMPRESSORS
from desim.unpacking import Unpacking

_MCAP, _BAG = b"\x89MCAP0\r\n", b"#ROSBAG V"
_BAD_INDEX = re.compile("Bag is not indexed|Bag index looks damaged")  # rosbags says so
_ALLOWED = "allowed: an .mcap file, a .bag file of ROS 1, the folder of a bag of ROS 2"
_NOTHING = "structure_needs_at_least_one_member"  # as rosbags calls that of an empty type
_LARGEST_RECORD_BYTES = 256_000_000  # attachments are records, too
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
        if path.is_dir() and not (path / bag_folder.METADATA).is_file():
            raise InputError(f"{path}: is no folder of a bag of ROS 2: it has no "
                             f"{bag_folder.METADATA}; {_ALLOWED}")
        self._is_mcap = not path.is_dir() and self._begins() == _MCAP

    def messages(self, kinds: Collection[str]) -> Iterator[TopicMessage]:
        """The messages of these types, in the order of the file. Raises ``InputError`` where there
        is none that can be read."""
        try:
            for read in self._mcap(kinds) if self._is_mcap else self._bag(kinds):
                self.count += 1
                yield read
        except InputError:
            raise
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
                        _refuse_endless(store, schema.name)
                        channels[record.id] = record.topic, schema.name, record.message_encoding
                elif isinstance(record, McapMessage) and (
                        channel := channels.get(record.channel_id)):
                    topic, kind, encoding = channel
                    read = store.deserialize_cdr if encoding == "cdr" else store.deserialize_ros1
                    yield TopicMessage(record.log_time, topic, kind, read(record.data, kind))

    def _records(self, file: BinaryIO) -> Iterator[McapRecord]:
        """All records. A chunk with wrong bytes is left out."""
        unpacking = Unpacking(self.path, self.path.stat().st_size)
        for record in StreamReader(file, emit_chunks=True,
                                   record_size_limit=_LARGEST_RECORD_BYTES).records:
            if not isinstance(record, Chunk):
                yield record
                continue
            try:
                if record.compression in DECOMPRESSORS:
                    record = replace(record, compression="", data=unpacking.whole(
                        record.data, DECOMPRESSORS[record.compression]))
                yield from _inside(record)
            except InputError:
                raise
            except Exception as error:  # of zstd, lz4, struct, and whatever they call
                self.broken = described(error)

    def _bag(self, kinds: Collection[str]) -> Iterator[TopicMessage]:
        packed_bytes = (bag_folder.checked_bytes(self.path) if self.path.is_dir() else
                        self.path.stat().st_size)
        with unpacked_parts.limited(Unpacking(self.path, packed_bytes)), \
                AnyReader([self.path], default_typestore=get_typestore(Stores.LATEST)) as reader:
            self.topics |= {one.topic: one.msgtype for one in reader.connections}
            wanted = [one for one in reader.connections if one.msgtype in kinds]
            for one in wanted:
                _refuse_endless(reader.typestore, one.msgtype)
            for one, time_ns, data in reader.messages(wanted) if wanted else ():
                yield TopicMessage(time_ns, one.topic, one.msgtype,
                                   reader.deserialize(data, one.msgtype))


def _inside(chunk: Chunk) -> Iterator[McapRecord]:
    """The records of a chunk that is unpacked, one by one. Raises whatever is wrong with it."""
    stream, length = get_chunk_data_stream(chunk, validate_crc=True)
    while stream.count < length:
        opcode, size = stream.read1(), stream.read8()
        if opcode == Opcode.CHANNEL:
            yield Channel.read(stream)
        elif opcode == Opcode.MESSAGE:
            yield McapMessage.read(stream, size)
        elif opcode == Opcode.SCHEMA:
            yield Schema.read(stream)
        else:
            stream.read(size)


def _refuse_endless(store: Typestore, kind: str) -> None:
    """Raise ``ValueError`` for a type of messages in which a part takes no byte: a few bytes could
    ask for any number of them."""
    kinds = [kind]  # grows
    for one in kinds:
        fields = store.fielddefs[one][1]
        if not fields or fields[0][0] == _NOTHING:
            raise ValueError(f"{kind} has {one} inside, which is empty")
        for name, (node, what) in fields:
            if node in (Nodetype.ARRAY, Nodetype.SEQUENCE):
                (inner, what), count = what
                if node == Nodetype.ARRAY and not count:
                    raise ValueError(f"{one} has {name}, an array of 0")
                node = inner
            if node == Nodetype.NAME and what not in kinds:
                kinds.append(what)
