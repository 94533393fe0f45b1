"""A worker process of a ``Crew``: ``python -m desim.campaign.running.worker ARGUMENT``."""

from __future__ import annotations

import os
import sys
from contextlib import suppress
from itertools import count
from typing import TYPE_CHECKING

from desim.engine.garbage import freeze_present_objects
from desim.operating_system.children import connection_to_parent

if TYPE_CHECKING:
    from desim.results.row import Row


def main(argument: str) -> None:
    """Work on the tasks that come in until the connection ends."""
    connection = connection_to_parent(argument)
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


if __name__ == "__main__":
    main(sys.argv[1])
