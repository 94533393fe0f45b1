"""Give wheels and sdists one time, one owner and plain modes: a commit then has the same bytes.

    python tools/reproducible.py SECONDS_SINCE_1970 FILE ...
"""

import gzip
import sys
import tarfile
import time
import zipfile
from io import BytesIO
from pathlib import Path


def wheel(path: Path, time_s: int) -> None:
    """Write a wheel again, its files in the order in which they are."""
    with zipfile.ZipFile(path) as archive:
        files = [(info, archive.read(info)) for info in archive.infolist()]
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for info, content in files:
            plain = zipfile.ZipInfo(info.filename, time.gmtime(time_s)[:6])
            plain.external_attr = (0o100000 | _mode(info.external_attr >> 16)) << 16
            archive.writestr(plain, content, zipfile.ZIP_DEFLATED)


def sdist(path: Path, time_s: int) -> None:
    """Write an sdist again, its files in the order of their names."""
    with tarfile.open(path) as archive:
        files = sorted(((info, archive.extractfile(info).read() if info.isfile() else b"")
                        for info in archive), key=lambda one: one[0].name)
    with open(path, "wb") as file, gzip.GzipFile("", "wb", fileobj=file, mtime=time_s) as packed, \
            tarfile.open(fileobj=packed, mode="w", format=tarfile.PAX_FORMAT) as archive:
        for info, content in files:
            plain = tarfile.TarInfo(info.name)
            plain.type, plain.linkname, plain.mtime = info.type, info.linkname, time_s
            plain.size = len(content)
            plain.mode = 0o755 if info.isdir() else _mode(info.mode)
            archive.addfile(plain, BytesIO(content))


def _mode(mode: int) -> int:
    return 0o755 if mode & 0o100 else 0o644


if __name__ == "__main__":
    for name in sys.argv[2:]:
        (wheel if name.endswith(".whl") else sdist)(Path(name), int(sys.argv[1]))
