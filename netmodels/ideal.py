"""A network without limits: everything arrives."""

from __future__ import annotations

from pydantic import Field

from desim import ports
from desim.units import Duration
from netmodels.itemized import Itemized


class Ideal(Itemized):
    """Everything arrives after the same time, however much there is.

    Capabilities: Itemizes.
    """

    class Params(ports.Params):
        delay_ns: Duration = Field("0 ns", description="from sending to arrival (ideal: none)")

    reasons = ()

    def __init__(self, params: Params) -> None:
        self._delay_ns = params.delay_ns

    def start(self, context: ports.Context, hosts: tuple[str, ...]) -> None:
        """Nothing to do: it needs neither time nor places."""

    def send(self, frame: ports.Frame) -> int:
        self._ledger.spent(frame, ports.TimePart.PROPAGATION, self._delay_ns)
        return self._delay_ns
