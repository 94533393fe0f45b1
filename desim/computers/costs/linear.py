"""Linear costs: a fixed part, and a part in proportion to each quantity of work."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

from desim.ports.computers import Kept, Work

ANY = "any"  # the trigger that stands for all that have no row of their own
_PS_PER_NS = 1000
_HALF_PS = 500  # for rounding


class CallbackCost(NamedTuple):
    """The cost of a callback: ``fixed_ps``, and ``per_ps`` for each unit of a quantity, by the
    names of ``ports.computers.QUANTITIES``."""

    fixed_ps: int = 0
    per_ps: Mapping[str, int] = {}


class MessageCost(NamedTuple):
    """The cost of a message: ``message_ps``, and ``byte_ps`` for each byte; for each connection to
    which it is written ``link_ps``, and ``link_byte_ps`` for each byte."""

    message_ps: int = 0
    byte_ps: int = 0
    link_ps: int = 0
    link_byte_ps: int = 0


class ProcessMemory(NamedTuple):
    """``fixed_bytes`` of a process, and ``per_bytes`` by the names of ``ports.computers.KEPT``."""

    fixed_bytes: int = 0
    per_bytes: Mapping[str, int] = {}


class MemoryTable(NamedTuple):
    """``system_bytes`` of a computer, and its ``processes`` by node."""

    system_bytes: int = 0
    processes: Mapping[str, ProcessMemory] = {}


class LinearCosts:
    """Costs of ``callbacks`` by node and trigger, ``ANY`` for other triggers of that node. A
    callback without a row costs nothing, and a process without one has no memory. Sums are rounded
    to whole nanoseconds."""

    def __init__(self, callbacks: Mapping[str, Mapping[str, CallbackCost]], send: MessageCost,
                 receive: MessageCost, memory: MemoryTable) -> None:
        self._callbacks, self._send, self._receive = callbacks, send, receive
        self._memory = memory

    def callback_ns(self, work: Work) -> int:
        return self.of_callback_ns(*work)

    def of_callback_ns(self, node: str, trigger: str, quantities: Mapping[str, int]) -> int:
        """``callback_ns`` of ``Work`` that nobody makes."""
        rows = self._callbacks.get(node)
        row = None if rows is None else rows.get(trigger) or rows.get(ANY)
        if row is None:
            return 0
        fixed_ps, per_ps = row
        cost_ps = fixed_ps + _HALF_PS
        if per_ps:
            for name, count in quantities.items():
                if name in per_ps:
                    cost_ps += count * per_ps[name]
        return cost_ps // _PS_PER_NS

    def send_ns(self, topic: str, size_bytes: int, links: int) -> int:
        cost = self._send
        return (cost.message_ps + size_bytes * cost.byte_ps
                + links * (cost.link_ps + size_bytes * cost.link_byte_ps) + _HALF_PS) // _PS_PER_NS

    def receive_ns(self, topic: str, size_bytes: int) -> int:
        cost = self._receive
        return (cost.message_ps + size_bytes * cost.byte_ps + _HALF_PS) // _PS_PER_NS

    def system_bytes(self) -> int:
        return self._memory.system_bytes

    def process_bytes(self, kept: Kept) -> int:
        row = self._memory.processes.get(kept.node)
        if row is None:
            return 0
        per_bytes = row.per_bytes
        return row.fixed_bytes + sum(count * per_bytes.get(name, 0)
                                     for name, count in kept.quantities.items())
