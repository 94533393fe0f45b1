"""Checks of cost models: does a class keep its contract?"""

from __future__ import annotations

from collections.abc import Iterator

from desim.computers.computer import CheckedCosts
from desim.computers.memory import Memory
from desim.ports.computers import KEPT, QUANTITIES, CostModel, Kept, MemoryModel
from desim.testing.advice import PluginClass, check_form, made, need
from desim.testing.checks import own_streams

_NODES = ("slam", "localization", "mapping", "map_sharing", "move_base", "explore", "monitor_feed",
          "a_node_that_nobody_knows")
_TRIGGERS = ("odom", "pose", "control", "tick", "a_trigger_that_nobody_knows")
_SIZES = (0, 1, 1448, 1_000_000)


def check_computers(cls: PluginClass[CostModel], **params: object) -> None:
    """Check a ``ports.computers.CostModel``: each answer is an int >= 0 of nanoseconds, for any
    node, trigger, quantities and topic, and the same questions have the same answers in the next
    run. Likewise a ``MemoryModel``, in bytes."""
    check_form("computers", cls, params)
    with own_streams(cls):
        first = list(_answers(made(cls, params)))
        again = list(_answers(made(cls, params)))
    need(first == again, cls, "give the same costs in each run: keep state in self, and read no "
                              "clock")


def _answers(costs: CostModel) -> Iterator[int]:
    """The costs of all sorts of things. Raises ``ModelError`` for what is none."""
    checked = CheckedCosts(costs)
    for node in _NODES:
        for trigger in _TRIGGERS:
            of_callback_ns = checked.of_callback(node, trigger)
            for count in (0, 1, 10_000):
                yield of_callback_ns(dict.fromkeys(QUANTITIES, count))
            yield of_callback_ns({})
    for size_bytes in _SIZES:
        yield checked.receive_ns("scan", size_bytes)
        for links in (1, 30):
            yield checked.send_ns("map_exchange", size_bytes, links)
    if isinstance(costs, MemoryModel):
        memory = Memory(costs, None)
        yield memory.system_bytes()
        for node in _NODES:
            yield memory.process_bytes(Kept(node, {}))
            yield memory.process_bytes(Kept(node, dict.fromkeys(KEPT, 10_000)))
