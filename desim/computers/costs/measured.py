"""Measured costs of real robot software; the numbers are in ``measured_values`` beside this."""

from __future__ import annotations

from desim import ports
from desim.computers.costs.linear import LinearCosts
from desim.computers.costs.measured_values import CALLBACKS, MEMORY, RECEIVE, SEND


class MeasuredCosts(LinearCosts):
    """The costs of ROS 1 software on a processor of speed 1."""

    class Params(ports.Params):
        pass

    def __init__(self, params: Params) -> None:
        super().__init__(CALLBACKS, SEND, RECEIVE, MEMORY)
