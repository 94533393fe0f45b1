"""A process's share of the machine: cores, address space, memory."""

from __future__ import annotations

import os
import sys
from contextlib import suppress
from pathlib import Path

try:
    import resource
except ImportError:  # Windows
    resource = None  # type: ignore[assignment]  # it is not there

_PROCESS = Path("/proc/self")  # Linux, proc(5)


def cores() -> int:
    """The number of this machine's cores that desim may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def address_space_bytes() -> int | None:
    """The limit on this process's address space (``ulimit -v``); None without one."""
    if resource is None:
        return None
    limit, _ = resource.getrlimit(resource.RLIMIT_AS)
    return None if limit == resource.RLIM_INFINITY else limit


def resident_bytes() -> int:
    """The memory that this process has now; 0 where only Linux would say it."""
    with suppress(OSError):
        pages = int((_PROCESS / "statm").read_text("ascii").split()[1])
        return pages * os.sysconf("SC_PAGE_SIZE")
    return 0


def peak_memory_bytes() -> int | None:
    """The most memory that this process had; None where the system does not say."""
    if resource is None:
        return None
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return peak if sys.platform == "darwin" else peak * 1024


def forget_peak_memory() -> None:
    """Count the peak from now on, where the system can: a worker of a campaign makes many runs."""
    with suppress(OSError):
        (_PROCESS / "clear_refs").write_text("5", "ascii")


def children() -> list[int]:
    """The processes that the threads of this one have started, or have inherited as orphans; none
    where only Linux would say."""
    return sorted(int(pid) for task in _PROCESS.glob("task/*/children")
                  for pid in task.read_text("ascii").split())
