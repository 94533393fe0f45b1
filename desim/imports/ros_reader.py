"""Reading of recordings of ROS tools: MCAP files, bags of ROS 1, folders of ROS 2 bags."""

from __future__ import annotations

import os
import re
import struct
import zlib
from collections.abc import Callable, Collection, Iterator
from contextlib import contextmanager
from io import BytesIO
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import BinaryIO

from mcap.data_stream import ReadDataStream
from mcap.exceptions import EndOfFile, RecordLengthLimitExceeded
from mcap.opcode import Opcode
from mcap.records import Channel, Chunk, McapRecord, Schema
from mcap.records import Message as McapMessage
from rosbags.highlevel import AnyReader
from rosbags.interfaces import Nodetype
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from rosbags.typesys.store import Typestore

from desim.errors import InputError, described
from desim.export.ros.message_types import TopicMessage
from desim.files import opened
from desim.imports import bag_folder, unpacked_parts
from desim.imports.unpacked_parts import DECOMPRESSORS
from desim.scenario import file_kinds
from desim.scenario.file_kinds import FileKind
from desim.unpacking import Unpacking

_MCAP = b"\x89MCAP0\r\n"
_BAD_INDEX = re.compile("Bag is not indexed|Bag index looks damaged")  # rosbags says so
_ALLOWED = ("allowed: an MCAP file, a bag of ROS 1, the folder of a bag of ROS 2, a .db3 of it, or "
            "a TUM trajectory")
_TABLE = "robots follow a CSV of poses without an import (coordination.strategy: follow)"
# The names by which rosbags knows formats; ours are known by their content.
_ENDINGS: dict[FileKind | None, str] = {file_kinds.ROS_1_BAG: ".bag",
                                        file_kinds.ROS_2_DATABASE: ".db3"}
_ODD = re.compile("[?#%]")
_NOTHING = "structure_needs_at_least_one_member"  # as rosbags calls that of an empty type
_LARGEST_RECORD_BYTES = 128_000_000
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
        self._kind = None if path.is_dir() else self._kind_of_file()

    def messages(self, kinds: Collection[str]) -> Iterator[TopicMessage]:
        """The messages of these types, in the order of the file. Raises ``InputError`` where there
        is none that can be read."""
        try:
            for read in (self._mcap(kinds) if self._kind == file_kinds.MCAP else
                         self._bag(kinds)):
                self.count += 1
                yield read
        except InputError:
            raise
        except Exception as error:  # of any of the libraries below, at any damaged byte
            self.broken = described(error)
        if self.broken and not self.count:
            advice = "; rosbag reindex may mend it" if _BAD_INDEX.search(self.broken) else ""
            raise InputError(f"{self.path}: damaged: {self.broken}{advice}")

    def _kind_of_file(self) -> FileKind:
        try:
            kind, empty = file_kinds.kind_of(self.path), self.path.stat().st_size == 0
        except OSError as error:
            raise InputError(f"{self.path}: {error.strerror or error}") from error
        if empty:
            raise InputError(f"{self.path}: is empty")
        if kind is not None and (kind == file_kinds.MCAP or kind in _ENDINGS):
            return kind
        known = file_kinds.advice(self.path) or _TABLE * (self.path.suffix.lower() == ".csv")
        raise InputError(f"{self.path}: is no recording; "
                         f"{known}{'; ' if known else ''}{_ALLOWED}")

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
        file.seek(len(_MCAP))
        for record in _records_of(file, ends=True):
            if not isinstance(record, Chunk):
                yield record
                continue
            try:
                data, make = record.data, DECOMPRESSORS.get(record.compression)
                if make is not None:
                    data = unpacking.whole(data, make)
                if record.uncompressed_crc not in (0, zlib.crc32(data)):
                    raise ValueError("a chunk has another checksum than it says")
                yield from _records_of(BytesIO(data), ends=False)
            except InputError:
                raise
            except Exception as error:  # of zstd, lz4, struct, and whatever they call
                self.broken = described(error)

    def _bag(self, kinds: Collection[str]) -> Iterator[TopicMessage]:
        if self._kind is None:
            packed_bytes = bag_folder.checked_bytes(self.path)
        else:
            packed_bytes = self.path.stat().st_size
        if self._kind == file_kinds.ROS_2_DATABASE:
            bag_folder.refuse_made_rows(self.path)
        with unpacked_parts.limited(Unpacking(self.path, packed_bytes)), \
                _named(self.path, _ENDINGS.get(self._kind, "")) as path, \
                AnyReader([path], default_typestore=get_typestore(Stores.LATEST)) as reader:
            self.topics |= {one.topic: one.msgtype for one in reader.connections}
            wanted = [one for one in reader.connections if one.msgtype in kinds]
            for one in wanted:
                _refuse_endless(reader.typestore, one.msgtype)
            for one, time_ns, data in reader.messages(wanted) if wanted else ():
                yield TopicMessage(time_ns, one.topic, one.msgtype,
                                   reader.deserialize(data, one.msgtype))


@contextmanager
def _named(path: Path, ending: str) -> Iterator[Path]:
    """``path`` under a name that ends so and has nothing that an address of SQLite cannot have."""
    if path.name.endswith(ending) and not _ODD.search(str(path)):
        yield path
        return
    with TemporaryDirectory() as folder:
        link = Path(folder) / f"recording{ending}"
        link.symlink_to(path.absolute())
        yield link


def _records_of(file: BinaryIO, ends: bool) -> Iterator[McapRecord]:
    """The records of a file, which ends with a footer, or of a chunk, which ends anywhere. Only
    those that desim reads are in memory, one by one, and nothing is read beyond its record."""
    while head := file.read(_HEAD.size):
        if len(head) < _HEAD.size:
            raise EndOfFile
        opcode, size = _HEAD.unpack(head)
        if opcode == Opcode.FOOTER:
            return
        if opcode not in _READ:
            file.seek(size, os.SEEK_CUR)
            continue
        if size > _LARGEST_RECORD_BYTES:
            raise RecordLengthLimitExceeded(opcode, size, _LARGEST_RECORD_BYTES)
        data = file.read(size)
        if len(data) < size:
            raise EndOfFile
        yield _READ[opcode](ReadDataStream(BytesIO(data)), size)
    if ends:
        raise EndOfFile


_HEAD = struct.Struct("<BQ")  # of a record: its kind, its size
_READ: dict[int, Callable[[ReadDataStream, int], McapRecord]] = {
    Opcode.SCHEMA: lambda stream, _: Schema.read(stream),
    Opcode.CHANNEL: lambda stream, _: Channel.read(stream),
    Opcode.CHUNK: lambda stream, _: Chunk.read(stream),
    Opcode.MESSAGE: McapMessage.read}


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
