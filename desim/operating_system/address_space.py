"""Refuse to start where the address-space limit (``ulimit -v``) is too small to compile kernels.

numba imports scipy.linalg when it compiles its first kernel. Below that limit OpenBLAS in there
waits for ever for a buffer, and other libraries abort the process; asking first gives one clear
line instead.
"""

import os

from desim.errors import InputError
from desim.operating_system.resources import address_space_bytes, cores

# The least with which scenarios/hello.yaml comes to its end (numba 0.68, scipy 1.17, pyarrow on
# x86_64 Linux): 575 000 kB with one thread of OpenBLAS, 650 000 kB with two.
_LEAST_BYTES = 600_000_000
_THREAD_BYTES = 90_000_000


def refuse_small() -> None:
    """Raises ``InputError`` where the limit is too small."""
    limit = address_space_bytes()
    wanted = _LEAST_BYTES + _THREAD_BYTES * (_threads() - 1)
    if limit is not None and limit < wanted:
        raise InputError(f"a process may have {limit // 1024} kB of address space (ulimit -v); "
                         f"desim wants {wanted // 1024} kB at least"
                         + (", less with OPENBLAS_NUM_THREADS=1" if _threads() > 1 else ""))


def _threads() -> int:
    """Number of threads that OpenBLAS will start."""
    for name in "OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS":
        if os.environ.get(name, "").isdecimal():
            return max(int(os.environ[name]), 1)
    return cores()
