"""The folder of compiled kernels.

Its name contains a hash of all kernel files. Without it, after a change in
``desim/ports/kernels.py``, other modules' machine code would still have the old version inside.
It is in the user's cache, since an installation may be read-only. numba keeps there what plug-ins
compile without desim.
"""

from __future__ import annotations

import hashlib
import os
import sys
import tempfile
from importlib.util import find_spec
from pathlib import Path


def choose_folder() -> None:
    """Set ``NUMBA_CACHE_DIR``, unless the user has."""
    if "NUMBA_CACHE_DIR" in os.environ:
        return
    folder = str(_writable() / f"kernels-{_fingerprint()}")
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


def _writable() -> Path:
    """The user's cache folder, or one among the temporary files."""
    try:
        home = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
        cache = Path(home) / "desim"
        cache.mkdir(parents=True, exist_ok=True)
        if os.access(cache, os.W_OK):
            return cache
    except (OSError, RuntimeError):  # RuntimeError: nobody's home
        pass
    return Path(tempfile.gettempdir()) / f"desim-{os.getuid()}"
