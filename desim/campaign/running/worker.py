"""A worker process of a ``Crew``: ``python -m desim.campaign.running.worker FD``."""

from __future__ import annotations

import os
import select
import sys
import threading
from contextlib import suppress
from itertools import count
from multiprocessing.connection import Connection

from desim.engine.garbage import keep_what_there_is


def main(descriptor: int) -> None:
    """Work on what comes in until nobody is at the other end."""
    threading.Thread(target=_leave_with_parent, args=(descriptor,), daemon=True).start()
    connection = Connection(descriptor)
    from desim.campaign.running.work import work
    from desim.errors import InputError

    for number in count():
        if number < 2:  # the first run imports the rest
            keep_what_there_is()
        try:
            task = connection.recv()
        except (EOFError, OSError):
            return
        try:
            outcome = work(task)
        except InputError as error:  # which ends the campaign
            outcome = error
        with suppress(OSError):  # a campaign that was killed hears nothing any more
            connection.send(outcome)


def _leave_with_parent(descriptor: int) -> None:
    """A campaign that was killed leaves nobody behind who writes into its folder."""
    hung_up = select.poll()
    hung_up.register(descriptor, 0)  # POLLHUP is always told
    hung_up.poll()
    os._exit(1)


if __name__ == "__main__":
    main(int(sys.argv[1]))
