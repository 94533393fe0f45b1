"""A table of costs that the scenario contains."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from typing import Annotated

from pydantic import AfterValidator, Field

from desim import ports
from desim.computers.costs.linear import (
    ANY,
    CallbackCost,
    LinearCosts,
    MemoryTable,
    MessageCost,
    ProcessMemory,
)
from desim.errors import did_you_mean
from desim.ports.computers import KEPT, QUANTITIES
from desim.units import ByteSize, Cost


def _one_of(names: Sequence[str], otherwise: str) -> AfterValidator:
    """Accepts ``names``; others are refused as being ``otherwise``."""
    def checked(name: str) -> str:
        if name not in names:
            raise ValueError(f"{otherwise}{did_you_mean(name, names)}; allowed: {', '.join(names)}")
        return name
    return AfterValidator(checked)


_Quantity = Annotated[str, _one_of(QUANTITIES, "no quantity of work")]
_Kept = Annotated[str, _one_of(KEPT, "no quantity that nodes keep")]


class CallbackRow(ports.Params):
    """The cost of a callback."""

    fixed_ps: Cost = Field("0 ns", description="each time")
    per: dict[_Quantity, Cost] = Field({}, description=(
        "for each unit of work: bytes, scans, beams, particles, cells, candidates, plans"))


class SendRow(ports.Params):
    """The cost of a message for its publisher."""

    message_ps: Cost = Field("0 ns", description="each time")
    byte_ps: Cost = Field("0 ns", description="of a message: to serialize it")
    link_ps: Cost = Field("0 ns", description="of each connection: a system call")
    link_byte_ps: Cost = Field("0 ns", description="of each connection: to copy it")


class ReceiveRow(ports.Params):
    """The cost of a message for each node that subscribes to it."""

    message_ps: Cost = Field("0 ns", description="each time")
    byte_ps: Cost = Field("0 ns", description="of a message")


class ProcessRow(ports.Params):
    """The memory of a node's process."""

    fixed_bytes: ByteSize = Field("0 B", description="when it keeps nothing")
    per: dict[_Kept, ByteSize] = Field({}, description=(
        "for each unit that is kept: bytes (of waiting messages), cells, patches, scans"))


class MemoryRows(ports.Params):
    """The memory of a computer."""

    system_bytes: ByteSize = Field("0 B", description="of all other programs and shared libraries")
    processes: dict[str, ProcessRow] = Field({}, description=(
        "by node; any: all others; what has no row takes none"))


class TableOfCosts(LinearCosts):
    """Costs from a table in the scenario: of callbacks by node and trigger, of messages sent and
    received. A trigger is a topic without its host's name, a timer, or ``any``."""

    class Params(ports.Params):
        callbacks: dict[str, dict[str, CallbackRow]] = Field({}, description=(
            "by node and trigger, e.g. {move_base: {control: {fixed: 1 ms}}}; any: all other "
            "triggers of the node; what has no row costs nothing"))
        send: SendRow = Field(default_factory=SendRow, description=(
            "a message, for its publisher (default: nothing)"))
        receive: ReceiveRow = Field(default_factory=ReceiveRow, description=(
            "a message, for each node that subscribes (default: nothing)"))
        memory: MemoryRows = Field(default_factory=MemoryRows, description=(
            "of the system and of processes (default: none)"))

    def __init__(self, params: Params) -> None:
        processes = params.memory.processes
        self._nodes = *params.callbacks, *(node for node in processes if node != ANY)  # with rows
        self._triggers = tuple((node, trigger) for node, rows in params.callbacks.items()
                              for trigger in rows if trigger != ANY)
        send, receive = params.send, params.receive
        super().__init__(
            {node: {trigger: CallbackCost(row.fixed_ps, row.per) for trigger, row in rows.items()}
             for node, rows in params.callbacks.items()},
            MessageCost(send.message_ps, send.byte_ps, send.link_ps, send.link_byte_ps),
            MessageCost(receive.message_ps, receive.byte_ps),
            MemoryTable(params.memory.system_bytes, {
                node: ProcessMemory(row.fixed_bytes, row.per)
                for node, row in processes.items()}))

    def unused_rows(self, ran: Collection[str]) -> Iterator[str]:
        """See ``UnusedRows``."""
        for node in dict.fromkeys(self._nodes):
            if node not in ran:
                yield (f"computers: no node of the run was called {node!r}"
                       f"{did_you_mean(node, sorted(ran))}")
        for node, trigger in self._triggers:
            if node in ran and (node, trigger) not in self.asked:
                known = sorted(own for other, own in self.asked if other == node)
                yield (f"computers: node {node!r} had no trigger {trigger!r}"
                       f"{did_you_mean(trigger, known)}; it had: {', '.join(known)}")
        for (node, trigger), own in self.declared.items():
            if own.called and own.missing:
                yield (f"computers: {trigger!r} of node {node!r} never declared "
                       f"{_in_order(own.missing)}; it declared: "
                       f"{_in_order(own.names) or 'nothing'}")


def _in_order(quantities: Collection[str]) -> str:
    return ", ".join(name for name in QUANTITIES if name in quantities)
