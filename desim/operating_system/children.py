"""A child process with a connection, which is seen to die and is killed with its own children."""

from __future__ import annotations

import os
from collections.abc import Callable
from multiprocessing.connection import Connection
from typing import Protocol

from desim.operating_system import child_elsewhere, child_on_linux


class Child(Protocol):
    """A process that runs a module, which calls ``connection_to_parent`` with its argument."""

    connection: Connection

    @property
    def signs(self) -> list[Connection | int]:
        """Handles of which one becomes ready when something happens: an answer, its death, or,
        where that can be waited for, more output."""

    def printed(self, most_bytes: int) -> bytes:
        """More of what it has printed, if there is more now."""

    def end(self) -> str:
        """Kill the process and its children; returns the cause of its death."""


begun: Callable[[str], Child]
begun, _connection = ((child_on_linux.LinuxChild, child_on_linux.connection)
                      if child_on_linux.IS_HERE else
                      (child_elsewhere.PlainChild, child_elsewhere.connection))


def connection_to_parent(argument: str) -> Connection:
    """The child's end of the connection. From now on the child dies when its parent does."""
    connection = _connection(argument)
    if hasattr(os, "register_at_fork"):  # a child of the child has nothing to say
        os.register_at_fork(after_in_child=connection.close)
    return connection
