"""The contract of a cost model: the processor time that callbacks and messages take, and memory.

All times are processor-nanoseconds at speed 1: the time that one processor of that speed needs with
nothing else to do. A model changes when things happen, never what is computed.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from typing import NamedTuple, Protocol, runtime_checkable

from desim.ports import parameters

# The quantities of work that nodes declare (``Node.worked``), and what one of each is.
QUANTITIES: Mapping[str, str] = {
    "bytes": "a byte of the message that the callback was called with",
    "scans": "a laser scan that was taken into a map or matched with one",
    "beams": "a beam of such a scan; a beam that k particles match counts k times",
    "particles": "a particle whose weight was computed",
    "cells": "a cell of a map or costmap that was written, sent, merged or searched",
    "candidates": "a velocity, frontier, pose or teammate that was rated",
    "plans": "a path that was searched",
}

# The quantities that nodes keep in memory (``Keeps``), and what one of each is.
KEPT: Mapping[str, str] = {
    "bytes": "a byte of a message that waits for its callback, or at a link to arrive",
    "cells": "a cell of a map or costmap",
    "patches": "32 x 32 cells of a particle's map; one that particles share counts once",
    "scans": "a laser scan that is remembered",
}


class Work(NamedTuple):
    """The work of one callback: ``trigger`` is the topic of its message without the host's name
    (``scan``), or the name of its timer (``control``); ``quantities`` are some of
    ``QUANTITIES``."""

    node: str
    trigger: str
    quantities: Mapping[str, int]


class CostModel(Protocol):
    """A plug-in that says how many processor-nanoseconds callbacks and messages take, an int >= 0
    for each. Built as ``CostModel(params)``, one for a run; it is asked once about each, in the
    order in which they happen."""

    @property
    def Params(self) -> type[parameters.Params]:
        """The class of its parameters, inside the plug-in's class."""

    def callback_ns(self, work: Work) -> int:
        """The time of a callback, without its messages."""

    def send_ns(self, topic: str, size_bytes: int, links: int) -> int:
        """The time of a message for its publisher: it is serialized once and written to each of
        ``links``. ``topic`` is without the host's name."""

    def receive_ns(self, topic: str, size_bytes: int) -> int:
        """The time of a message for one node that has subscribed to it, read or not."""


@runtime_checkable
class Keeps(Protocol):
    """A plug-in of localization or map sharing whose data take memory."""

    def kept(self) -> Mapping[str, int]:
        """The quantities that it keeps now, by the names of ``KEPT``."""


class Kept(NamedTuple):
    """The ``quantities`` that the process of ``node`` keeps, by the names of ``KEPT``."""

    node: str
    quantities: Mapping[str, int]


@runtime_checkable
class MemoryModel(Protocol):
    """A cost model that also says how much memory processes take, in bytes: an int >= 0. It is
    asked about a process again only when what this keeps has changed."""

    def system_bytes(self) -> int:
        """The memory of all that is not a node here: libraries that processes share, other
        programs."""

    def process_bytes(self, kept: Kept) -> int:
        """The memory that the process of a node has to itself."""


@runtime_checkable
class UnusedRows(Protocol):
    """A cost model that knows which of its rows a run did not use."""

    def unused_rows(self, ran: Collection[str]) -> Iterable[str]:
        """Warnings of them at the end of a run. ``ran``: the nodes that it had."""
