"""Computers without limits: callbacks and messages take no time."""

from __future__ import annotations

from desim import ports
from desim.ports.computers import Work


class IdealComputers:
    """Nothing takes time. A run with this model has neither processors nor executors."""

    class Params(ports.Params):
        pass

    def __init__(self, params: Params) -> None:
        pass

    def callback_ns(self, work: Work) -> int:
        return 0

    def send_ns(self, topic: str, size_bytes: int, links: int) -> int:
        return 0

    def receive_ns(self, topic: str, size_bytes: int) -> int:
        return 0
