"""A computer of a run: its processors and memory, the priorities of its nodes, and its cost model.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from typing import NoReturn

from desim.computers.costs.linear import LinearCosts, RememberedCosts
from desim.computers.memory import Memory
from desim.computers.processors import Processors
from desim.errors import ModelError, method_of
from desim.ports.computers import CostModel, Work


class Computer:
    """The processors and the memory of one host, and the costs of its work by a cost ``model``.
    ``priorities``: by node, 0 for nodes without one; under ``fixed_priority`` the highest runs
    first. ``memory``: None where the model has none."""

    __slots__ = ("processors", "model", "costs", "priorities", "memory")

    def __init__(self, processors: Processors, model: CostModel, priorities: Mapping[str, int],
                 memory: Memory | None = None) -> None:
        self.processors, self.priorities, self.memory = processors, priorities, memory
        self.model = model
        # A plug-in may inherit from ours and have callbacks of its own.
        self.costs: RememberedCosts | CheckedCosts = (
            model.remembered if isinstance(model, LinearCosts)
            and type(model).callback_ns is LinearCosts.callback_ns else CheckedCosts(model))


class CheckedCosts:
    """The costs by ``model``. Raises ``ModelError`` for an answer that is no int >= 0."""

    def __init__(self, model: CostModel) -> None:
        self._model = model

    def of_callback(self, node: str, trigger: str) -> Callable[[Mapping[str, int]], int]:
        """``CostModel.callback_ns`` as a function of the quantities alone."""
        return partial(self._callback_ns, node, trigger)

    def _callback_ns(self, node: str, trigger: str, quantities: Mapping[str, int]) -> int:
        work = Work(node, trigger, quantities)
        cost_ns = self._model.callback_ns(work)
        return cost_ns if _is_cost(cost_ns) else self._refuse(
            cost_ns, "callback_ns", work)

    def send_ns(self, topic: str, size_bytes: int, links: int) -> int:
        """See ``CostModel.send_ns``."""
        cost_ns = self._model.send_ns(topic, size_bytes, links)
        return cost_ns if _is_cost(cost_ns) else self._refuse(
            cost_ns, "send_ns", topic, size_bytes, links)

    def receive_ns(self, topic: str, size_bytes: int) -> int:
        """See ``CostModel.receive_ns``."""
        cost_ns = self._model.receive_ns(topic, size_bytes)
        return cost_ns if _is_cost(cost_ns) else self._refuse(
            cost_ns, "receive_ns", topic, size_bytes)

    def _refuse(self, cost_ns: object, method: str, *arguments: object) -> NoReturn:
        asked = ", ".join(map(repr, arguments))
        raise ModelError(f"{method_of(self._model, method)} answered {cost_ns!r} to {asked}; "
                         "wanted: an int >= 0, in ns")


def _is_cost(cost_ns: object) -> bool:
    return type(cost_ns) is int and cost_ns >= 0
