"""The folder of compiled kernels.

Its name contains a hash of all kernel files. Without it, after a change in
``desim/ports/kernels.py``, other modules' machine code would still have the old version inside.
It is in the user's cache, since an installation may be read-only. numba keeps there what plug-ins
compile without desim. What lies there runs as machine code: a folder in which another user could
write is never taken.
"""

from __future__ import annotations

import atexit
import hashlib
import os
import shutil
import stat
import sys
import tempfile
from collections.abc import Iterator
from contextlib import suppress
from importlib.util import find_spec
from pathlib import Path

from desim.operating_system.folders import is_mine_alone, user_name


def choose_folder() -> None:
    """Set ``NUMBA_CACHE_DIR``, unless the user has."""
    if "NUMBA_CACHE_DIR" in os.environ:
        return
    folder = str(own_folder(f"kernels-{_fingerprint()}"))
    os.environ["NUMBA_CACHE_DIR"] = folder
    if "numba" in sys.modules:  # it has read the environment already
        sys.modules["numba"].config.CACHE_DIR = folder


def _fingerprint() -> str:
    digest = hashlib.sha256()
    for package in "desim", "netmodels":  # the latter is found, not imported
        spec = find_spec(package)
        if spec is None or spec.origin is None:
            continue
        root = Path(spec.origin).parent
        for source in sorted([*root.rglob("kernels.py"), *root.rglob("kernels/*.py"),
                              *root.glob("compiler/*.py")]):
            digest.update(source.read_bytes())
    return digest.hexdigest()[:12]


def own_folder(name: str) -> Path:
    """A folder ``name`` in the user's cache, or else among the temporary files. Where neither is
    the user's alone, a new one, which goes when this process ends."""
    for parent in _parents():
        if _is_own(parent) and _is_own(parent / name):
            return parent / name
    new = tempfile.mkdtemp(prefix="desim-")
    atexit.register(shutil.rmtree, new, ignore_errors=True)
    return Path(new)


def _parents() -> Iterator[Path]:
    with suppress(RuntimeError):  # nobody's home
        yield Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "desim"
    yield Path(tempfile.gettempdir()) / f"desim-{user_name()}"


def _is_own(folder: Path) -> bool:
    """Whether a folder, made if need be, is the user's and nobody else can write in it."""
    try:
        folder.parent.mkdir(parents=True, exist_ok=True)
        folder.mkdir(mode=0o700, exist_ok=True)
        status = folder.lstat()
    except OSError:
        return False
    return (stat.S_ISDIR(status.st_mode) and is_mine_alone(status)
            and os.access(folder, os.W_OK))
