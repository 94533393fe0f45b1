"""Whether the numerical kernels still have to be compiled, which the first run does."""

from __future__ import annotations

import os
from collections.abc import Iterator
from importlib.util import find_spec
from pathlib import Path


def cold() -> bool:
    """Whether some of desim's kernels have no compiled copy on disk. How old a copy is need not be
    looked at: the folder that it lies in is named by what the sources say."""
    return any(next(_indices(source), None) is None
               for source in Path(find_spec("desim").origin).parent.rglob("kernels.py"))


def _indices(source: Path) -> Iterator[Path]:
    """numba's index files of a module: in ``NUMBA_CACHE_DIR`` where that is set, else beside the
    source, or in the user's own cache where the source cannot be written to."""
    elsewhere = os.environ.get("NUMBA_CACHE_DIR")
    if not elsewhere:
        yield from (source.parent / "__pycache__").glob("kernels.*.nbi")
        elsewhere = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "numba"
    yield from Path(elsewhere).glob(f"{source.parent.name}_*/kernels.*.nbi")
