"""Two threads of which one runs at a time: a run can pause in the midst of an instant."""

from __future__ import annotations

import threading
from collections.abc import Callable


class Dropped(BaseException):
    """The outer thread will not come back. No ``Exception``: no model shall take it for its own."""


class Baton:
    """Runs ``life`` in a thread of its own, which moves only inside of ``lend``.

    ``life`` waits in ``give``, with all that it has called so far, until the outer thread lends the
    baton again. ``hurry`` is called when Ctrl-C or another exception reaches the outer thread
    while it waits: ``life`` shall give the baton back soon.
    """

    def __init__(self, life: Callable[[], object], hurry: Callable[[], object]) -> None:
        self._life, self._hurry = life, hurry
        self._inner, self._outer = threading.Lock(), threading.Lock()
        self._inner.acquire()
        self._outer.acquire()
        self._thread = threading.Thread(target=self._live, daemon=True)
        self._error: BaseException | None = None
        self._is_dropped = False

    def lend(self) -> None:
        """Let ``life`` go on until it gives or returns. Raises what it raised."""
        if self._thread.ident is None:
            self._thread.start()
        self._inner.release()
        try:
            self._outer.acquire()
        except BaseException:
            self._hurry()
            self._outer.acquire()
            raise
        error, self._error = self._error, None
        if error is not None:
            raise error

    def give(self) -> None:
        """Wait in ``life`` until the outer thread lends again."""
        self._outer.release()
        self._inner.acquire()
        if self._is_dropped:
            raise Dropped

    def drop(self) -> None:
        """End the thread where it waits."""
        self._is_dropped = True
        if self._thread.is_alive():
            self._inner.release()
            self._thread.join()

    def _live(self) -> None:
        self._inner.acquire()
        try:
            self._life()
        except Dropped:
            return
        except BaseException as error:  # also SystemExit of a plug-in: it is the outer thread's
            self._error = error
        self._outer.release()
