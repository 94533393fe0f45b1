"""Whether numerical kernels still have to be compiled, which their first import does."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path


def cold(source: Path) -> bool:
    """Whether the kernels of a file have no compiled copy on disk. How old a copy is need not be
    looked at: the folder that it lies in is named by what the sources say."""
    return next(_indices(source), None) is None


@contextmanager
def announced(say: Callable[[], object]) -> Iterator[None]:
    """``say`` is called before the first import of cold kernels inside: desim's, or a plug-in's,
    which may be anywhere and are not known before a scenario has been read."""
    watcher = _Watcher(say)
    sys.meta_path.insert(0, watcher)
    try:
        yield
    finally:
        sys.meta_path.remove(watcher)


class _Watcher:
    """An import finder that finds nothing, but sees what is looked for."""

    def __init__(self, say: Callable[[], object]) -> None:
        self._say: Callable[[], object] | None = say

    def find_spec(self, name: str, path: Sequence[str] | None, target: object = None) -> None:
        if self._say is not None and path and name.rpartition(".")[2] == "kernels":
            source = Path(path[0]) / "kernels.py"
            if source.is_file() and cold(source):
                say, self._say = self._say, None
                say()


def _indices(source: Path) -> Iterator[Path]:
    """numba's index files of a module: in ``NUMBA_CACHE_DIR`` where that is set, else beside the
    source, or in the user's own cache where the source cannot be written to."""
    elsewhere = os.environ.get("NUMBA_CACHE_DIR")
    if not elsewhere:
        yield from (source.parent / "__pycache__").glob("kernels.*.nbi")
        elsewhere = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "numba"
    yield from Path(elsewhere).glob(f"{source.parent.name}_*/kernels.*.nbi")
