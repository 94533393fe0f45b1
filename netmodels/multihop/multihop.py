"""Routing over several hops, on top of a model of single ones."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import Literal

from pydantic import Field

from desim import ports
from desim.errors import ModelError
from netmodels.hops import HopLedger
from netmodels.journeys import Journey
from netmodels.multihop.batman import Batman, BatmanConstants
from netmodels.multihop.hop_choice import HOPS, HopChoice
from netmodels.multihop.on_hops import OnHops
from netmodels.multihop.static import Static, StaticParams

_HOP_LIMIT, _NO_PATH = ports.Drop("hop_limit"), ports.Drop("no_path")
_RELAY_DOWN, _RELAY_NO_PATH = ports.Drop("relay_down"), ports.Drop("relay_no_path")
_OWN = frozenset({"hop_limit", "no_path", "relay_down", "relay_no_path"})


def _relayed(hop: type[ports.NetworkModel] | ports.NetworkModel) -> set[str]:
    """The reasons for which a relay drops a frame that its hop refuses."""
    return {f"relay_{reason}" for reason in getattr(hop, "refuses", ())}


class Multihop(OnHops):
    """Routes on top of single hops: each host passes frames on for others, whole frames (a train,
    too, has to be there before it goes on), from the queue of its ``hop`` model. Routes are found
    by ``routing``, whose messages are on the same air.

    A frame, or a packet of a train, is lost where a hop of it is, for that hop's reason; where its
    sender (``no_path``) or a host on the way (``relay_no_path``) knows no route, where that one is
    down (``relay_down``) or its queue is full (``relay_queue_full``), and after ``hop_limit`` hops.
    A broadcast goes one hop, as an IP router's does.

    Capabilities: Refuses, Separates, FollowsHosts, CountsControl, Itemizes; if its hop has them,
    CountsAttempts, CountsBusyTime, CountsAirtime, KnowsDepartures, Retransmits.
    """

    class Params(HopChoice):
        routing: Literal["batman", "static"] = Field("batman", description=(
            "a protocol on the air, or shortest paths that everybody knows for nothing (what such "
            "networks do)"))
        batman: BatmanConstants = Field(BatmanConstants(), description=(
            "of routing: batman (batman-adv)"))
        static: StaticParams = Field(StaticParams(), description="of routing: static (its own "
                                                                 "defaults)")
        hop_limit: int = Field(50, ge=1, le=255, description="hops that a frame may make "
                                                             "(batman-adv)")

    reasons: tuple[str, ...] = tuple(sorted(_OWN.union(
        *(model.reasons for model in HOPS.values()),
        *(_relayed(model) for model in HOPS.values()))))
    refuses: tuple[str, ...] = ("no_path", *sorted(set().union(*(getattr(model, "refuses", ())
                                                for model in HOPS.values()))))

    def __init__(self, params: Params, hop: ports.NetworkModel | None = None) -> None:
        """``hop``: see ``OnHops``. With routing ``static`` it is a ``ports.KnowsLinks``."""
        super().__init__(params, hop)
        if hop is not None:
            self.reasons = (*hop.reasons, *_relayed(hop), *sorted(_OWN))
            self.refuses = ("no_path", *getattr(hop, "refuses", ()))
        hop, self._limit = self._hop, params.hop_limit
        if isinstance(hop, ports.CountsAttempts):
            self.attempts = hop.attempts
        if isinstance(hop, ports.KnowsDepartures):
            self.departure_ns = hop.departure_ns
        self.routing: Batman | Static = Batman(params.batman)
        if params.routing == "static":
            if not isinstance(hop, ports.KnowsLinks):
                raise ModelError("routing: static needs a hop that is a ports.KnowsLinks")
            self.routing = Static(params.static, hop.links)

    def start(self, context: ports.Context, hosts: tuple[str, ...]) -> None:
        super().start(context, hosts)
        self.routing.start(self._hops, hosts)

    def send(self, frame: ports.Frame) -> int | None:
        if frame.broadcast:
            return self._hop.send(frame)
        dest = frame.receivers[0]
        next_hop = self.routing.next_hop(frame.source, dest)
        if next_hop == dest:
            return self._hop.send(frame)
        if next_hop is None:
            self._context.settle(frame, dest, _NO_PATH)
        else:
            self._forward(Journey(frame), frame.source, next_hop)
        return None

    def switched(self, host: int, up: bool) -> None:
        """A host has started or stopped."""
        self._hops.switched(host, up)
        self.routing.switched(host, up)

    def separates(self, host: int, other: int) -> bool:
        """Whether no unicast frame gets from one to the other now, as far as the former knows."""
        return self.routing.next_hop(host, other) is None

    def control(self) -> tuple[int, int]:
        """Frames and bytes that routing has sent so far."""
        return self.routing.frames, self.routing.bytes

    def _forward(self, journey: Journey, host: int, next_hop: int) -> None:
        journey.made += 1
        self._hops.send(host, (next_hop,), journey.size_bytes(), len(journey.left), False,
                        partial(self._settled, journey), journey.frame.id)

    def _settled(self, journey: Journey, leg: ports.Frame, _: Sequence[int],
                 verdict: ports.Deliver | ports.Drop, lost: dict[int, str]) -> None:
        """A hop is over: settle the packets that it has lost, and send on the rest."""
        frame, (host,) = journey.frame, leg.receivers
        settle, dest = self._context.settle, frame.receivers[0]
        if journey.made == 1:
            self._context.left(frame)
        if self._ledger is not None:
            self._stamp(self._ledger, frame, leg, verdict)
        for reason, packets in journey.without(lost).items():
            settle(frame, dest, ports.Drop(reason, tuple(packets)))
        if not journey.left:
            return
        if isinstance(verdict, ports.Drop):
            relayed = journey.made > 1 and verdict.reason in self.refuses
            settle(frame, dest, ports.Drop(f"relay_{verdict.reason}") if relayed else verdict)
        elif host == dest:
            settle(frame, dest, verdict)
        elif verdict.delay_ns:
            self._context.at(self._context.now_ns + verdict.delay_ns, self._arrived,
                             (journey, host))
        else:
            self._arrived((journey, host))

    def _stamp(self, ledger: HopLedger, frame: ports.Frame, leg: ports.Frame,
               verdict: ports.Deliver | ports.Drop) -> None:
        """A hop is over: tell its parts, or where it was lost."""
        if isinstance(verdict, ports.Deliver):
            ledger.pass_on(frame, ledger.parts(leg, self._context.now_ns + verdict.delay_ns))
        ledger.lost_at(frame, leg.source)

    def _arrived(self, arrived: tuple[Journey, int]) -> None:
        """A frame has arrived at a relay."""
        journey, host = arrived
        dest = journey.frame.receivers[0]
        next_hop = self.routing.next_hop(host, dest) if self._hops.up[host] else None
        if next_hop is not None and journey.made < self._limit:
            self._forward(journey, host, next_hop)
        else:
            if self._ledger is not None:
                self._ledger.lost_at(journey.frame, host)
            self._context.settle(journey.frame, dest, _RELAY_DOWN if not self._hops.up[host]
                                 else _RELAY_NO_PATH if next_hop is None else _HOP_LIMIT)
