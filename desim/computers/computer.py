"""A computer of a run: its processors and memory, the priorities of its nodes, and its cost model.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import NoReturn

from desim.computers.memory import Memory
from desim.computers.processors import Processors
from desim.errors import ModelError, class_of
from desim.ports.computers import CostModel, Work


@dataclass(frozen=True, slots=True)
class Computer:
    """The processors, the memory and the costs of one host. ``priorities``: by node, 0 for nodes
    without one; under ``fixed_priority`` the highest runs first. ``memory``: None where ``costs``
    says nothing of it. The methods return the costs of ``costs``, and raise ``ModelError`` for a
    cost that is no int >= 0."""

    processors: Processors
    costs: CostModel
    priorities: Mapping[str, int]
    memory: Memory | None = None

    def callback_ns(self, work: Work) -> int:
        """See ``CostModel.callback_ns``."""
        cost_ns = self.costs.callback_ns(work)
        if type(cost_ns) is int and cost_ns >= 0:
            return cost_ns
        return self._refuse(cost_ns, f"callback_ns({work})")

    def send_ns(self, topic: str, size_bytes: int, links: int) -> int:
        """See ``CostModel.send_ns``."""
        cost_ns = self.costs.send_ns(topic, size_bytes, links)
        if type(cost_ns) is int and cost_ns >= 0:
            return cost_ns
        return self._refuse(cost_ns, f"send_ns({topic!r}, {size_bytes}, {links})")

    def receive_ns(self, topic: str, size_bytes: int) -> int:
        """See ``CostModel.receive_ns``."""
        cost_ns = self.costs.receive_ns(topic, size_bytes)
        if type(cost_ns) is int and cost_ns >= 0:
            return cost_ns
        return self._refuse(cost_ns, f"receive_ns({topic!r}, {size_bytes})")

    def _refuse(self, cost_ns: object, asked: str) -> NoReturn:
        raise ModelError(f"{class_of(self.costs)} answered {cost_ns!r} to {asked}; wanted: an int "
                         ">= 0, in ns")
