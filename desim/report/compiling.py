"""The first run compiles the kernels; say so before, and how long it took after."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from importlib.util import find_spec
from pathlib import Path


def cold() -> bool:
    """Whether some kernels have no compiled copy on disk that is as new as their source.

    Looks where numba puts its indices: ``NUMBA_CACHE_DIR``, or ``__pycache__`` beside the source.
    """
    elsewhere = os.environ.get("NUMBA_CACHE_DIR")
    for package in ("desim", "netmodels"):
        root = Path(find_spec(package).origin).parent
        for source in root.rglob("kernels.py"):
            if elsewhere:
                found = Path(elsewhere).glob(f"{source.parent.name}_*/kernels.*.nbi")
            else:
                found = (source.parent / "__pycache__").glob("kernels.*.nbi")
            newest = max((index.stat().st_mtime for index in found), default=0.0)
            if newest < source.stat().st_mtime:
                return True
    return False


@contextmanager
def announced(say: Callable[[str], None]) -> Iterator[None]:
    """Around the first import of the kernels."""
    if not cold():
        yield
        return
    say("compiling numerical kernels (first run only)...")
    begin_s = time.perf_counter()
    yield
    say(f"compiled in {time.perf_counter() - begin_s:.1f} s")
