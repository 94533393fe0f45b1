"""A rule's view of its medium."""

from __future__ import annotations

from operator import attrgetter
from typing import TYPE_CHECKING

import numpy as np

from desim.ports import Obstacles

if TYPE_CHECKING:
    from desim.network.medium import Medium


class MediumView:
    """The ``ports.RuleContext`` of the rule called ``name``."""

    def __init__(self, medium: Medium, name: str) -> None:
        self._medium = medium
        self._name = name
        self._kernel = medium._kernel
        self.positions = medium.positions

    now_ns = property(attrgetter("_kernel.now_ns"))

    @property
    def obstacles(self) -> Obstacles:
        return self._medium.obstacles

    def stream(self, *name: str | int) -> np.random.Generator:
        return self._medium.stream(self._name, *name)
