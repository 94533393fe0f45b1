"""A folder of a bag of ROS 2, checked before rosbags reads it."""

from __future__ import annotations

import re
import sqlite3
from contextlib import closing
from pathlib import Path
from urllib.parse import quote

import yaml

from desim import outside_yaml
from desim.errors import InputError, described
from desim.files import content_below, opened_below, plain_parts, reading

METADATA = "metadata.yaml"
_MOST_BYTES = 10_000_000  # of the metadata
_SQLITE = b"SQLite format 3\0"
# Tables whose rows are made while they are read: there may be any number of them, of any size.
_MADE = re.compile(r"\b(AS|VIRTUAL|VIEW)\b", re.IGNORECASE)


def checked_bytes(folder: Path) -> int:
    """The size of the bag's files together. Raises ``InputError`` for metadata that is too much to
    read, for files that are not in the folder, and for a database that makes up its rows."""
    path = folder / METADATA
    with reading(path):
        text = content_below(folder, METADATA, _MOST_BYTES)
    try:
        named = outside_yaml.read(text)["rosbag2_bagfile_information"]["relative_file_paths"]
        # bags of ROS 2 Dashing and Eloquent name their own folder as well
        names = [str(name).rpartition("/")[2] for name in named]
    except (KeyError, TypeError, ValueError, yaml.YAMLError) as error:
        raise InputError(f"{path}: damaged: {described(error)}") from None
    return sum(_checked_bytes(folder, name) for name in names)


def _checked_bytes(folder: Path, name: str) -> int:
    path = folder / name
    with reading(path):
        plain_parts(name)
        with opened_below(folder, name) as file:
            begins, size = file.read(len(_SQLITE)), file.seek(0, 2)
    if begins == _SQLITE:
        refuse_made_rows(path)
    return size


def refuse_made_rows(path: Path) -> None:
    """Raise ``InputError`` for a database that makes up its rows."""
    address = f"file:{quote(str(path.absolute()))}?mode=ro&immutable=1"
    try:
        with closing(sqlite3.connect(address, uri=True)) as database:
            for kind, table, made in database.execute(
                    "SELECT type, name, sql FROM sqlite_master"):
                if kind not in ("table", "index") or _MADE.search(made or ""):
                    raise InputError(f"{path}: {table!r} is a {kind} that makes up its rows; "
                                     "allowed: plain tables")
    except sqlite3.Error as error:
        raise InputError(f"{path}: damaged: {error}") from None
