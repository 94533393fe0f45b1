"""Refuse to start where the address-space limit (``ulimit -v``) is too small to compile kernels.

numba imports scipy.linalg when it compiles its first kernel. Below that limit OpenBLAS in there
waits for ever for a buffer, and other libraries abort the process; asking first gives one clear
line instead.
"""

import os
import resource

from desim.errors import InputError

# The least with which scenarios/hello.yaml comes to its end (numba 0.68, scipy 1.17, pyarrow on
# x86_64 Linux): 575 000 kB with one thread of OpenBLAS, 650 000 kB with two.
_LEAST_BYTES = 600_000_000
_THREAD_BYTES = 90_000_000


def refuse_small() -> None:
    """Raises ``InputError`` where the limit is too small."""
    limit, _ = resource.getrlimit(resource.RLIMIT_AS)
    wanted = _LEAST_BYTES + _THREAD_BYTES * (_threads() - 1)
    if limit != resource.RLIM_INFINITY and limit < wanted:
        raise InputError(f"a process may have {limit // 1024} kB of address space (ulimit -v); "
                         f"desim wants {wanted // 1024} kB at least"
                         + (", less with OPENBLAS_NUM_THREADS=1" if _threads() > 1 else ""))


def _threads() -> int:
    """Number of threads that OpenBLAS will start."""
    for name in "OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS":
        if os.environ.get(name, "").isdecimal():
            return max(int(os.environ[name]), 1)
    return len(os.sched_getaffinity(0))
