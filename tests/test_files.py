"""Files in folders that somebody else has made."""

import os

import pytest

from desim.errors import InputError
from desim.files import content, content_below, opened_below, reading, replacing


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "outside").write_text("secret")
    folder = tmp_path / "folder"
    (folder / "map").mkdir(parents=True)
    (folder / "a.json").write_text("a")
    (folder / "map" / "b.pgm").write_text("bb")
    (folder / "link").symlink_to("../outside")
    (folder / "own").symlink_to("a.json")
    (folder / "up").symlink_to("..")
    os.mkfifo(folder / "pipe")
    return folder


def test_files_by_plain_names_are_read(folder):
    assert content_below(folder, "a.json", 10) == b"a"
    assert content_below(folder, "map/b.pgm", 10) == b"bb"


@pytest.mark.parametrize("name", ["../outside", "map/../a.json", "/etc/passwd", "", ".", "..",
                                  "./a.json", "map//b.pgm", "a\0", "\x1b[31m", None, 7, ["a"]])
def test_names_that_may_lead_out_are_refused(folder, name):
    with pytest.raises(OSError) as caught, opened_below(folder, name):
        pass
    assert caught.value.strerror == f"{name!r} is no name of a file in a folder"


@pytest.mark.parametrize(("name", "wrong"), [
    ("link", "is a symbolic link, which desim does not follow"),
    ("own", "is a symbolic link, which desim does not follow"),
    ("up/outside", "is a symbolic link, which desim does not follow"),
    ("pipe", "is no regular file"),
    ("map", "Is a directory"),
    ("a.json/b", "Not a directory"),
    ("gone", "No such file or directory"),
    ("map/b.pgm", "has 0.0 MB; at most 0 MB")])
def test_what_is_no_file_of_the_folder_is_not_opened(folder, name, wrong):
    with pytest.raises(InputError) as caught, reading(folder / name):
        content_below(folder, name, 1)
    assert str(caught.value) == f"{folder / name}: cannot be read: {wrong}"


def test_devices_are_not_read():
    with pytest.raises(OSError, match="is no regular file"):
        content("/dev/zero", 10)


def test_a_file_is_replaced_at_once_or_not_at_all(folder):
    with pytest.raises(OSError), replacing(folder / "a.json") as beside:
        beside.write_text("cut o")
        raise OSError
    assert (folder / "a.json").read_text() == "a"
    with replacing(folder / "a.json") as beside:
        beside.write_text("new")
    assert (folder / "a.json").read_text() == "new"
