"""Network models on top of single hops: what those that relay frames have in common."""

from __future__ import annotations

from desim import ports
from netmodels.hops import HopLedger, Hops
from netmodels.multihop.hop_choice import HopChoice


class OnHops:
    """A network model whose frames go over single hops. It knows of the air what its hop knows."""

    _ledger: HopLedger | None = None

    def __init__(self, params: HopChoice, hop: ports.NetworkModel | None) -> None:
        """``hop``: a single-hop model that is made already, instead of the one in ``params``."""
        self._block = f".{params.hop}" if hop is None else ""
        self._hop = hop = params.chosen() if hop is None else hop
        if isinstance(hop, ports.CountsAirtime):
            self.airtime_ns = hop.airtime_ns
        if isinstance(hop, ports.CountsBusyTime):
            self.busy_ns = hop.busy_ns
        if isinstance(hop, ports.Retransmits):
            self.judges_transmissions = hop.judges_transmissions

    def itemize(self, ledger: ports.Ledger) -> None:
        self._ledger = HopLedger(ledger, isinstance(self._hop, ports.Itemizes))
        if isinstance(self._hop, ports.Itemizes):
            self._hop.itemize(self._ledger)

    def start(self, context: ports.Context, hosts: tuple[str, ...]) -> None:
        self._context = context
        self._hops = Hops(self._hop, context, hosts, self._block, self._ledger)
