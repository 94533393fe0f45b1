"""The needs of real programs, and what of that is on this machine."""

from __future__ import annotations

import platform
import shutil
import sys
from typing import NamedTuple

from desim.errors import InputError
from desim.loop.guest_kernel import guest_kernel, newest_source

_TOOLS = {"ip": "iproute2", "mount": "mount"}  # a program, and Debian's package of it
_TOOLS_OF_BUILD = {"gcc": "gcc", "make": "make", "flex": "flex", "bison": "bison", "bc": "bc",
                   "tar": "tar", "xz": "xz-utils"}


class Finding(NamedTuple):
    """A thing that real programs need, or (not ``needed``) that makes it. ``remedy``: how to get
    it; None where it is there."""

    what: str
    remedy: str | None
    needed: bool = True


def refuse_other_systems() -> None:
    """Raise ``InputError`` unless this is Linux on x86-64."""
    if sys.platform != "linux" or platform.machine() != "x86_64":
        raise InputError("real programs run on Linux on x86-64 alone; desim loop needs its kernel")


def findings() -> list[Finding]:
    """All findings; a machine that is not Linux on x86-64 has one."""
    if sys.platform != "linux":
        return [Finding("Linux", "real programs run in a guest of Linux on x86-64 alone")]
    kernel = _kernel()
    built = kernel.remedy is None
    return [*(_tool(*tool, needed=True) for tool in _TOOLS.items()),
            *(_tool(*tool, needed=not built) for tool in _TOOLS_OF_BUILD.items()),
            _source(built), kernel]


def _tool(program: str, package: str, needed: bool) -> Finding:
    there = shutil.which(program, path="/usr/sbin:/sbin:/usr/bin:/bin:/usr/local/bin")
    return Finding(f"program {program}", None if there else f"apt-get install {package}", needed)


def _source(built: bool) -> Finding:
    found = newest_source()
    if found:
        return Finding(f"sources of Linux: {found}", None)
    return Finding("sources of Linux", "apt-get install linux-source, or desim loop build --source",
                   not built)


def _kernel() -> Finding:
    try:
        return Finding(f"guest kernel: {guest_kernel()}", None)
    except InputError as error:
        return Finding("guest kernel", str(error))
