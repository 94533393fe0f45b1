"""An alarm at an instant of the monotonic clock, in ns (timerfd_create(2)).

A timeout of ``select`` counts from when it is called, in us: how often a process has looked at the
clock before, which takes 256 ns in the guest, would move all that it does later.
"""

from __future__ import annotations

import ctypes
import os

from desim.units import NS_PER_S

_MONOTONIC = 1  # CLOCK_MONOTONIC of linux/time.h
_ABSOLUTE = 1  # TFD_TIMER_ABSTIME of sys/timerfd.h


class _Setting(ctypes.Structure):
    """``struct itimerspec``: the interval, and the first instant."""

    _fields_ = [(name, ctypes.c_long) for name in (
        "interval_s", "interval_ns", "first_s", "first_ns")]


class Alarm:
    """``descriptor`` can be read from once the alarm has rung, until it is set again."""

    def __init__(self) -> None:
        self._libc = ctypes.CDLL(None, use_errno=True)
        self.descriptor = self._libc.timerfd_create(_MONOTONIC,
                                                    os.O_CLOEXEC | os.O_NONBLOCK)
        self._refuse(self.descriptor)

    def set(self, at_ns: int) -> None:
        """Let it ring at ``at_ns``, which is not 0; at once if that is over."""
        setting = _Setting(0, 0, *divmod(at_ns, NS_PER_S))
        self._refuse(self._libc.timerfd_settime(self.descriptor, _ABSOLUTE, ctypes.byref(setting),
                                                None))

    def _refuse(self, answer: int) -> None:
        if answer < 0:
            error = ctypes.get_errno()
            raise OSError(error, os.strerror(error))
