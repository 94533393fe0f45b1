"""A worker process of a ``Crew``: ``python -m desim.campaign.running.worker FD``."""

from __future__ import annotations

import ctypes
import os
import select
import signal
import sys
import threading
from contextlib import suppress
from itertools import count
from multiprocessing.connection import Connection
from typing import TYPE_CHECKING

from desim.engine.garbage import freeze_present_objects

_PR_SET_PDEATHSIG = 1  # prctl(2)

if TYPE_CHECKING:
    from desim.results.row import Row


def main(descriptor: int) -> None:
    """Work on the tasks that come in until the connection ends."""
    driver = os.getppid()
    # Even where a plug-in's machine code never lets Python have its turn.
    ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)
    if os.getppid() != driver:
        return
    threading.Thread(target=_leave_with_parent, args=(descriptor,), daemon=True).start()
    connection = Connection(descriptor)
    os.register_at_fork(after_in_child=connection.close)  # a child has nothing to say
    from desim.campaign.running import work  # noqa: F401 (before the state is taken)
    from desim.campaign.running.state import ProcessState
    from desim.errors import InputError

    before = ProcessState()
    connection.send(None)  # it is ready
    for number in count():
        if number < 2:  # the first run imports the rest
            freeze_present_objects()
        try:
            task = connection.recv()
        except (EOFError, OSError):
            return
        try:
            outcome: Row | InputError = task.made()
        except InputError as error:  # which ends the campaign
            outcome = error
        for stream in (sys.stdout, sys.stderr):
            with suppress(Exception):  # a plug-in may have closed it
                stream.flush()
        changed = before.changed()
        if changed:
            with suppress(Exception):
                os.write(2, f"left another state: {', '.join(changed)}\n".encode())
        with suppress(OSError):  # the campaign may have been killed
            connection.send((outcome, not changed))


def _leave_with_parent(descriptor: int) -> None:
    """End with the campaign: one that was killed leaves no process that writes into its folder."""
    hung_up = select.poll()
    hung_up.register(descriptor, 0)  # POLLHUP is always reported
    hung_up.poll()
    os.killpg(os.getpid(), signal.SIGKILL)  # with its children


if __name__ == "__main__":
    main(int(sys.argv[1]))
