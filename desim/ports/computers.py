"""The contract of a cost model: the processor time that callbacks and messages take.

All times are processor-nanoseconds at speed 1: the time that one processor of that speed needs with
nothing else to do. Costs come on top of what is simulated anyway: a model changes when things
happen, never what is computed.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple, Protocol

from desim.ports import parameters

# The quantities of work that nodes declare (``Node.worked``), and what one of each is.
QUANTITIES: Mapping[str, str] = {
    "bytes": "a byte of the message that the callback was called with",
    "scans": "a laser scan that was taken into a map or matched with one",
    "beams": "a beam of such a scan; a beam that k particles match counts k times",
    "particles": "a particle whose weight was computed",
    "cells": "a cell of a map or costmap that was written, sent, merged or searched",
    "candidates": "a velocity, frontier or pose that was rated",
    "plans": "a path that was searched",
}


class Work(NamedTuple):
    """The work of one callback: ``trigger`` is the topic of its message without the host's name
    (``scan``), or the name of its timer (``control``); ``quantities`` are some of
    ``QUANTITIES``."""

    node: str
    trigger: str
    quantities: Mapping[str, int]


class CostModel(Protocol):
    """Says how many processor-nanoseconds things take, each an int >= 0. Built as
    ``CostModel(params)``, one for a run; it is asked once for each of them, in the order in which
    they happen."""

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
