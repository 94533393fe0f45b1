"""Files that unpack to far more than their size, and other ways to say much in few bytes."""

import bz2
import gzip
import os
import sqlite3

import lz4.frame
import pytest
from hypothesis import given
from hypothesis import strategies as st
from mcap.writer import CompressionType, Writer
from rosbags.rosbag2.reader import zstd
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from desim.errors import InputError
from desim.imports import bag_folder
from desim.imports.ros_reader import RosRecording, _refuse_endless
from desim.imports.unpacked_parts import DECOMPRESSORS
from desim.unpacking import Unpacking, lines

PACK = {"bz2": bz2.compress, "lz4": lz4.frame.compress, "zstd": zstd.compress}


@pytest.mark.parametrize("kind", PACK)
@given(data=st.binary(min_size=1, max_size=300), cut=st.integers(1, 8))
def test_a_part_is_unpacked_whole_or_not_at_all(kind, data, cut):
    packed = PACK[kind](data)
    assert Unpacking("file", 0).whole(packed * 2, DECOMPRESSORS[kind]) == data * 2
    with pytest.raises(EOFError):
        Unpacking("file", 0).whole(packed[:-cut], DECOMPRESSORS[kind])


@pytest.mark.parametrize("kind", PACK)
def test_a_part_and_the_parts_together_have_a_limit(kind):
    packed = PACK[kind](bytes(65_000_000))
    with pytest.raises(InputError, match="^bag: a part of it unpacks to more than 64 MB; if that "
                                         "is right, unpack it first$"):
        Unpacking("bag", 10**9).whole(packed, DECOMPRESSORS[kind])
    packed, unpacking = PACK[kind](bytes(60_000_000)), Unpacking("bag", 100_000)
    unpacking.whole(packed, DECOMPRESSORS[kind])
    with pytest.raises(InputError, match="^bag: it unpacks to more than 105 MB, far more than its "
                                         "size; if that is right, unpack it first$"):
        unpacking.whole(packed, DECOMPRESSORS[kind])


def test_lines_of_a_packed_file_are_those_of_the_file(tmp_path):
    text = b"".join(b"%d\r\n" % number for number in range(5000)) + b"end"
    (tmp_path / "plain").write_bytes(text)
    (tmp_path / "packed").write_bytes(gzip.compress(text))
    assert list(lines(tmp_path / "packed")) == list(lines(tmp_path / "plain"))
    assert list(lines(tmp_path / "plain"))[-1] == (5001, b"end")


def test_a_text_that_unpacks_to_far_more_is_refused_and_the_unpacked_one_is_read(tmp_path):
    text = b"ODOM 0 0 0 0 0 0 0\n" * 800_000
    (tmp_path / "log").write_bytes(text)
    (tmp_path / "log.gz").write_bytes(gzip.compress(text))
    with pytest.raises(InputError, match=r"log.gz: it unpacks to more than 1\d MB, far more"):
        list(lines(tmp_path / "log.gz"))
    assert sum(1 for _ in lines(tmp_path / "log")) == 800_000


def test_a_line_has_a_limit(tmp_path):
    (tmp_path / "log").write_bytes(b"a\n" + b"0" * 2_000_001)
    with pytest.raises(InputError, match="log:2: a line of more than 2 MB"):
        list(lines(tmp_path / "log"))


def test_a_pipe_is_no_log(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(OSError, match="no regular file"):
        list(lines(tmp_path / "pipe"))


@pytest.mark.parametrize("compression", [CompressionType.LZ4, CompressionType.ZSTD])
def test_a_chunk_of_mcap_unpacks_no_further_than_its_limit(tmp_path, compression):
    path = tmp_path / "bomb.mcap"
    with path.open("wb") as file:
        writer = Writer(file, chunk_size=1 << 30, compression=compression)
        writer.start()
        channel = writer.register_channel("/a", "cdr", writer.register_schema(
            "std_msgs/msg/String", "ros2msg", b"string data"))
        writer.add_message(channel, 0, bytes(65_000_000), 0)
        writer.finish()
    with pytest.raises(InputError, match="bomb.mcap: a part of it unpacks to more than 64 MB"):
        list(RosRecording(path).messages(["std_msgs/msg/String"]))


@pytest.mark.parametrize("fields, why", [
    ("std_msgs/Empty[] a", "x/msg/A has std_msgs/msg/Empty inside, which is empty"),
    ("uint8[0] b", "x/msg/A has b, an array of 0"),
    ("x/B[3] c", "x/msg/B has d, an array of 0")])
def test_a_message_whose_parts_take_no_bytes_is_refused(fields, why):
    store, line = get_typestore(Stores.EMPTY), "=" * 80
    store.register(get_types_from_msg(
        f"{fields}\n{line}\nMSG: std_msgs/Empty\n{line}\nMSG: x/B\nuint8[0] d\n", "x/msg/A"))
    with pytest.raises(ValueError, match=f"^{why}$"):
        _refuse_endless(store, "x/msg/A")


def test_all_types_of_ros_that_are_read_have_bytes():
    from desim.imports.ros_content import _KINDS

    for name in (Stores.ROS1_NOETIC, Stores.LATEST):
        store = get_typestore(name)
        for kind in _KINDS:
            if kind in store.fielddefs:
                _refuse_endless(store, kind)


def folder_of(path, *names):
    (path / "metadata.yaml").write_text(
        f"rosbag2_bagfile_information: {{relative_file_paths: {list(names)}}}\n")
    return path


def test_a_database_with_plain_tables_is_read_and_one_that_makes_up_rows_is_not(tmp_path):
    for name, made in (("plain", ""), ("view", "CREATE VIEW more AS SELECT 1"), (
            "generated", "CREATE TABLE m (a, b BLOB GENERATED ALWAYS AS (zeroblob(1000000000)))")):
        database = sqlite3.connect(tmp_path / name)
        database.executescript(f"CREATE TABLE messages (id, data BLOB); {made}")
        database.close()
    assert bag_folder.checked_bytes(folder_of(tmp_path, "plain")) == (
        tmp_path / "plain").stat().st_size
    for name, what in (("view", "'more' is a view"), ("generated", "'m' is a table")):
        with pytest.raises(InputError, match=f"{name}: {what} that makes up its rows; allowed: "
                                             "plain tables"):
            bag_folder.checked_bytes(folder_of(tmp_path, name))


def test_a_bag_names_only_files_in_its_folder(tmp_path):
    (tmp_path / "link").symlink_to("/etc/passwd")
    os.mkfifo(tmp_path / "pipe")
    for name, why in (("link", "is a symbolic link, which desim does not follow"),
                      ("pipe", "no regular file"), ("..", "is no name of a file in a folder"),
                      ("../../etc/passwd", "No such file")):
        with pytest.raises(InputError, match=why):
            bag_folder.checked_bytes(folder_of(tmp_path, name))


def test_metadata_of_brackets_is_refused(tmp_path):
    (tmp_path / "metadata.yaml").write_text("[" * 1_000_000)
    with pytest.raises(InputError, match="metadata.yaml: damaged: ValueError: nested too deeply; "
                                         "at most 100 lists and mappings"):
        bag_folder.checked_bytes(tmp_path)


def test_a_length_in_a_record_reaches_no_further_than_the_record(tmp_path):
    """Else the text of 4 GB that a topic says it has would be the rest of a large file."""
    channel = b"\4" + (12).to_bytes(8, "little") + b"\1\0\0\0" + b"\xff" * 4 + b"abcd"
    (tmp_path / "a.mcap").write_bytes(b"\x89MCAP0\r\n" + channel + b"\xfe" * 100)
    recording = RosRecording(tmp_path / "a.mcap")
    with pytest.raises(InputError, match=r"a\.mcap: damaged: EndOfFile"):
        list(recording.messages([]))


def test_attachments_of_any_size_are_passed_over(tmp_path):
    skipped = b"\x09" + (1 << 33).to_bytes(8, "little")
    with (tmp_path / "a.mcap").open("wb") as file:
        file.write(b"\x89MCAP0\r\n" + skipped)
        file.truncate(file.tell() + (1 << 33))  # takes no room on the disk
        file.seek(0, 2)
        file.write(b"\2" + bytes(8))
    recording = RosRecording(tmp_path / "a.mcap")
    assert list(recording.messages([])) == [] and recording.broken is None
