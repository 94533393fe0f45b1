"""A worker process of a ``Crew``: ``python -m desim.campaign.running.worker FD``."""

from __future__ import annotations

import os
import select
import sys
import threading
from contextlib import suppress
from itertools import count
from multiprocessing.connection import Connection
from typing import TYPE_CHECKING

from desim.engine.garbage import freeze_present_objects

if TYPE_CHECKING:
    from desim.results.row import Row


def main(descriptor: int) -> None:
    """Work on the tasks that come in until the connection ends."""
    threading.Thread(target=_leave_with_parent, args=(descriptor,), daemon=True).start()
    connection = Connection(descriptor)
    from desim.campaign.running.work import work
    from desim.errors import InputError

    for number in count():
        if number < 2:  # the first run imports the rest
            freeze_present_objects()
        try:
            task = connection.recv()
        except (EOFError, OSError):
            return
        try:
            outcome: Row | InputError = work(task)
        except InputError as error:  # which ends the campaign
            outcome = error
        with suppress(OSError):  # the campaign may have been killed
            connection.send(outcome)


def _leave_with_parent(descriptor: int) -> None:
    """End with the campaign: one that was killed leaves no process that writes into its folder."""
    hung_up = select.poll()
    hung_up.register(descriptor, 0)  # POLLHUP is always reported
    hung_up.poll()
    os._exit(1)


if __name__ == "__main__":
    main(int(sys.argv[1]))
