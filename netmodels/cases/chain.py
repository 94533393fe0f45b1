"""A row of hosts that relays the packets of the first one to the last one."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from pydantic import Field

from desim import ports
from desim.errors import InputError
from desim.ports.cases import Flow, Setup
from desim.units import NS_PER_S, BitRate, ByteSize, Length, Period, airtime_ns
from netmodels.cases.traffic import MOST_RADIO_BYTES, numbered, udp_bytes
from netmodels.ideal_mac import IdealMac
from netmodels.multihop import Multihop
from netmodels.multihop.batman import HEADER_BYTES, BatmanConstants
from netmodels.multihop.static import StaticParams
from netmodels.radio.dcf.radio import DcfRadio
from netmodels.radio.delivery import delivery
from netmodels.radio.standards import STANDARDS, psdu_bytes
from netmodels.tdma import Tdma

RANGE, INTERFERENCE = 1.1, 2.1  # of a frame, in hops: of ideal and tdma
_ASIDE = 0.04  # of the spare host, in hops: as good as in line (the diagonal is 0.1 % longer)
_REUSE = 4  # hops from a sender to the next one whom it may send with: the interference and two
_WARM_UP_NS = 2_000_000_000  # of the flow: some hundred packets over each hop
_HOP_LIMIT = 50  # batman-adv
_STANDARD = "11a"
# Link budget of ns-3 3.44, by which hosts 25 m apart find frames over two hops and not over three.
_TWO_HOPS: dict[str, dict[str, str]] = {"path_loss": {"reference": "46.6777 dB"},
                             "reception": {"preamble": "-82 dBm"}}
_LEARNING_NS = 5_000_000_000  # five intervals of batman, its memory of a route


class _Deserted(Multihop):
    """A chain whose relay from ``host`` to ``dest`` leaves at ``leaves_ns``, for good."""

    def __init__(self, params: Multihop.Params, host: str, dest: str, leaves_ns: int) -> None:
        super().__init__(params)
        self._way, self._leaves_ns = (host, dest), leaves_ns

    def start(self, context: ports.Context, hosts: tuple[str, ...]) -> None:
        super().start(context, hosts)
        context.at(self._leaves_ns, self._leave,
                   tuple(hosts.index(end) for end in self._way))

    def _leave(self, way: tuple[int, ...]) -> None:
        host, dest = way
        relay = self.routing.next_hop(host, dest)
        if relay is not None:
            self.switched(relay, False)


@dataclass(frozen=True)
class RelayChain:
    """A chain of hops that carries one saturated flow: two frames for each hop are on the way at
    any time. A frame hinders hosts two hops from its sender or nearer, so that of four hosts
    in a row one sends: a quarter of the single-hop rate is the most that a long chain carries, and
    carrier sense achieves less (Li, Blake, De Couto, Lee, Morris 2001). That holds for ``ideal``
    and ``tdma``, and for ``dcf`` from 24 Mb/s on. With ``dcf``, frames of 6 to 12 Mb/s survive a
    sender two hops from their receiver, 9 dB weaker than their own, and a third is the most; and
    below 24 Mb/s they get over two hops of 25 m at once, so that routes leave out every other host.
    ``goodput_share`` is of the goodput of one hop. With ``dcf`` the protocol's messages are as
    long as packets: shorter ones would get over two hops, which packets do not."""

    class Params(ports.Params):
        hops: int = Field(4, ge=1, le=100, description="from the first host to the last one (the "
                                                       "first chain that sends twice at once)")
        mac: Literal["ideal", "tdma", "dcf"] = Field("ideal", description=(
            "who sends when: as somebody says who knows everything, in slots that every fourth "
            "host shares, or by carrier sense of 802.11a (the bound)"))
        routing: Literal["static", "batman"] = Field("static", description=(
            "known to everybody for nothing, or a protocol on the same air (the bound)"))
        rate_bps: BitRate = Field("24 Mb/s", description="of all frames (reaches one hop, not two)")
        spacing_m: Length = Field("25 m", gt=0, description=(
            "from host to host (carrier sense reaches 51.4 m, and 24 Mb/s 45 m)"))
        payload_bytes: ByteSize = Field("1000 B", ge=1, le=MOST_RADIO_BYTES, description=(
            "of UDP (ns-3 reference)"))
        leave_ns: Period | None = Field(None, examples=["10 s"], description=(
            "after the start of the flow; of two hosts in the middle the one in use leaves, and "
            "the other one is to take its place (nobody leaves, and there is one only)"))
        duration_ns: Period = Field("10 s", description="that is measured, after two seconds of "
                                                        "the flow")

    params: Params

    def setup(self) -> Setup:
        p = self.params
        if p.leave_ns is not None and p.hops < 2:
            raise InputError(".leave: in a single hop there is no host in the middle")
        end_ns = _WARM_UP_NS + p.duration_ns
        if p.leave_ns is not None and p.leave_ns >= end_ns:
            raise InputError(f".leave: {p.leave_ns / NS_PER_S:g} s is not before the end, which is "
                             f"{end_ns / NS_PER_S:g} s after the start of the flow")
        one = None if p.hops == 1 else self._chain(1, None)
        return self._chain(p.hops, p.leave_ns)._replace(compared=one)

    def _chain(self, hops: int, leave_ns: int | None) -> Setup:
        p = self.params
        hosts = numbered("host", hops + 1)
        places = {host: (p.spacing_m * k, 0.0) for k, host in enumerate(hosts)}
        if leave_ns is not None:
            places["spare"] = p.spacing_m * (hops // 2), _ASIDE * p.spacing_m
        begin_ns = _LEARNING_NS if p.routing == "batman" else 0
        size_bytes = udp_bytes(p.payload_bytes)
        batman = BatmanConstants()
        if p.mac == "dcf":  # a short message would get farther than the packets
            batman = BatmanConstants(message=f"{size_bytes - HEADER_BYTES} B")
        params = Multihop.Params(routing=p.routing, batman=batman,
                                 hop_limit=max(p.hops, _HOP_LIMIT),
                                 **self._hop(hosts, size_bytes, leave_ns))
        model = (Multihop(params) if leave_ns is None
                 else _Deserted(params, hosts[hops // 2 - 1], hosts[-1], begin_ns + leave_ns))
        flow = Flow(hosts[0], (hosts[-1],), size_bytes, p.payload_bytes, backlog=2 * hops - 2,
                    begin_ns=begin_ns)
        warm_up_ns = begin_ns + _WARM_UP_NS
        return Setup(model, places, [flow], warm_up_ns + p.duration_ns, warm_up_ns)

    def _hop(self, hosts: tuple[str, ...], size_bytes: int, leave_ns: int | None) -> dict:
        """The parameters of single hops: a chain of n hops needs n slots, or as many as it takes
        until a slot may be used again; the spare host has its own."""
        p = self.params
        rate = f"{p.rate_bps} b/s"
        if p.mac == "dcf":
            radio = DcfRadio.Params(standard=_STANDARD, rate=rate, broadcast_rate=rate, **_TWO_HOPS)
            _check_reach(radio, p.spacing_m, size_bytes)
            return {"hop": "radio", "radio": radio}
        air = {"rate": rate, "range": f"{RANGE * p.spacing_m} m",
               "interference": f"{INTERFERENCE * p.spacing_m} m"}
        if p.mac == "ideal":
            return {"hop": "ideal_mac", "ideal_mac": IdealMac.Params(**air)}
        cycle = min(len(hosts) - 1, _REUSE)
        slots = {host: k % cycle for k, host in enumerate(hosts)}
        if leave_ns is not None:
            slots["spare"] = cycle
            cycle += 1
        return {"hop": "tdma", "tdma": Tdma.Params(
            cycle=cycle, slots=slots, slot=f"{airtime_ns(size_bytes, p.rate_bps)} ns", **air)}


def _check_reach(radio: DcfRadio.Params, spacing_m: float, size_bytes: int) -> None:
    """Refuse a rate that no hop of ``spacing_m`` can be used at. Raises ``InputError``."""
    rate, _ = radio.rates()
    power_dbm = radio.power_dbm - radio.loss().loss_db(spacing_m)
    share = float(delivery(power_dbm, STANDARDS[_STANDARD], rate, psdu_bytes(size_bytes, 1),
                           radio.reception.for_stations()))
    if share < StaticParams().usable:
        raise InputError(f".rate: {share:.0%} of packets at {radio.rate_bps / 1e6:g} Mb/s get over "
                         f"{spacing_m:g} m, too few for a hop; allowed: a slower rate, or hosts "
                         "nearer to each other (--spacing)")
