"""Linear costs: a fixed part, and a part in proportion to each quantity of work."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from functools import cache, lru_cache
from typing import NamedTuple

from desim.ports.computers import Kept, Work

ANY = "any"  # the trigger or process that stands for all that have no row of their own
_PS_PER_NS = 1000
_HALF_PS = 500  # for rounding
_REMEMBERED = 1 << 12  # costs of messages; those of a run have few sizes


class Declared:
    """The quantities that the callbacks of a row of costs declare: ``missing``, those of the row
    that have never come; ``names``, those that came while some were missing. ``called``: whether
    there was a callback at all."""

    __slots__ = ("missing", "names", "called")

    def __init__(self, wanted: Iterable[str]) -> None:
        self.missing, self.names, self.called = set(wanted), set[str](), False

    def note(self, quantities: Mapping[str, int]) -> None:
        """A callback has declared ``quantities``."""
        self.called = True
        self.names.update(quantities)
        self.missing.difference_update(quantities)


class CallbackCost(NamedTuple):
    """The cost of a callback: ``fixed_ps``, and ``per_ps`` for each unit of a quantity, by the
    names of ``ports.computers.QUANTITIES``."""

    fixed_ps: int = 0
    per_ps: Mapping[str, int] = {}

    def by_quantities(self, declared: Declared) -> Callable[[Mapping[str, int]], int]:
        """The cost in ns as a function of the quantities, of which it tells ``declared``."""
        base_ps, per_ps = self.fixed_ps + _HALF_PS, tuple(self.per_ps.items())
        fixed_ns = base_ps // _PS_PER_NS
        if not per_ps:
            return lambda quantities: fixed_ns

        missing = declared.missing

        def cost_ns(quantities: Mapping[str, int]) -> int:
            if missing:
                declared.note(quantities)
            if not quantities:
                return fixed_ns
            cost_ps = base_ps
            for name, each_ps in per_ps:
                if name in quantities:
                    cost_ps += quantities[name] * each_ps
            return cost_ps // _PS_PER_NS

        return cost_ns


class MessageCost(NamedTuple):
    """The cost of a message: ``message_ps``, and ``byte_ps`` for each byte. Each connection that it
    is written to adds ``link_ps``, and ``link_byte_ps`` for each byte."""

    message_ps: int = 0
    byte_ps: int = 0
    link_ps: int = 0
    link_byte_ps: int = 0


class ProcessMemory(NamedTuple):
    """``fixed_bytes`` of a process, and ``per_bytes`` by the names of ``ports.computers.KEPT``."""

    fixed_bytes: int = 0
    per_bytes: Mapping[str, int] = {}


class MemoryTable(NamedTuple):
    """``system_bytes`` of a computer, and its ``processes`` by node, ``ANY`` for all others."""

    system_bytes: int = 0
    processes: Mapping[str, ProcessMemory] = {}


class RememberedCosts:
    """The costs of ``model``, each computed once: the same work always costs the same. All
    computers use the same functions, so that these stay in the processor's caches."""

    def __init__(self, model: LinearCosts) -> None:
        self.of_callback = cache(model.of_callback)
        self.send_ns = lru_cache(_REMEMBERED)(model.send_ns)
        self.receive_ns = lru_cache(_REMEMBERED)(model.receive_ns)


class LinearCosts:
    """Costs of ``callbacks`` by node and trigger, ``ANY`` for other triggers of that node. A
    callback without a row costs nothing, and a process without one takes no memory. Sums are
    rounded to whole nanoseconds. ``asked``: the nodes and triggers whose costs a run has used;
    ``declared``: what these declare, by node and row."""

    def __init__(self, callbacks: Mapping[str, Mapping[str, CallbackCost]], send: MessageCost,
                 receive: MessageCost, memory: MemoryTable) -> None:
        self._callbacks, self._send, self._receive = callbacks, send, receive
        self._memory = memory
        self.asked: dict[tuple[str, str], None] = {}
        self.declared: dict[tuple[str, str], Declared] = {}
        self.remembered = RememberedCosts(self)

    def callback_ns(self, work: Work) -> int:
        return self.remembered.of_callback(work.node, work.trigger)(work.quantities)

    def of_callback(self, node: str, trigger: str) -> Callable[[Mapping[str, int]], int]:
        """The cost of a callback in ns, as a function of the quantities."""
        self.asked[node, trigger] = None
        rows = self._callbacks.get(node, {})
        name = trigger if trigger in rows else ANY
        row = rows.get(name, CallbackCost())
        return row.by_quantities(self.declared.setdefault((node, name), Declared(row.per_ps)))

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
        processes = self._memory.processes
        row = processes.get(kept.node) or processes.get(ANY)
        if row is None:
            return 0
        size_bytes, per_bytes = row.fixed_bytes, row.per_bytes
        for name, count in kept.quantities.items():
            if name in per_bytes:
                size_bytes += count * per_bytes[name]
        return size_bytes
