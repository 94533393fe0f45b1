"""Whether the numerical kernels still have to be compiled, which the first run does."""

from __future__ import annotations

import os
from collections.abc import Iterator
from importlib.util import find_spec
from pathlib import Path


def cold() -> bool:
    """Whether some kernels have no compiled copy on disk that is as new as their source."""
    for package in ("desim", "netmodels"):
        for source in Path(find_spec(package).origin).parent.rglob("kernels.py"):
            newest = max((index.stat().st_mtime for index in _indices(source)), default=0.0)
            if newest < source.stat().st_mtime:
                return True
    return False


def _indices(source: Path) -> Iterator[Path]:
    """numba's index files of a module: in ``NUMBA_CACHE_DIR`` where that is set, else beside the
    source, or in the user's own cache where the source cannot be written to."""
    elsewhere = os.environ.get("NUMBA_CACHE_DIR")
    if not elsewhere:
        yield from (source.parent / "__pycache__").glob("kernels.*.nbi")
        elsewhere = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "numba"
    yield from Path(elsewhere).glob(f"{source.parent.name}_*/kernels.*.nbi")
