"""The state of a process that a run must leave as it found it, or the next one may differ."""

from __future__ import annotations

import json
import math
import os
import signal
import sys
import threading

import numpy as np

from desim.operating_system.resources import children, resident_bytes

_WATCHED = (np, np.random, np.linalg, math, os, json)  # for patches
_MOST_GROWN_BYTES = 3 << 27  # by leaks; twice what two runs of maze_30 (120 s) leave: 192 MiB


class ProcessState:
    """The state of this process when this was made."""

    def __init__(self) -> None:
        self._before, self._size_bytes = _state(), resident_bytes()

    def changed(self) -> list[str]:
        """The names of what differs now."""
        now = _state()
        found = [name for name, value in self._before.items() if now[name] != value]
        return found + ["memory"] * (resident_bytes() > self._size_bytes + _MOST_GROWN_BYTES)


def _state() -> dict[str, object]:
    umask = os.umask(0)
    os.umask(umask)
    try:
        folder = os.getcwd()
    except OSError:  # it was removed
        folder = ""
    return {"working directory": folder, "environment": dict(os.environ), "umask": umask,
            "signal handlers": [signal.getsignal(number)
                                for number in sorted(signal.valid_signals())],
            "numpy's error state": np.geterr(), "threads": threading.active_count(),
            "children": children(), "standard streams": (sys.stdout, sys.stderr),
            "patched modules": {(module.__name__, name): id(value)
                                for module in _WATCHED for name, value in vars(module).items()
                                if callable(value) and not name.startswith("__")}}
