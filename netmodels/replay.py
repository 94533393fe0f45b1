"""Measured links, played again."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache, partial

from pydantic import Field

from desim import ports
from desim.units import BitRate, Duration, Ratio
from netmodels.attempts import TRIES, Attempts
from netmodels.itemized import Itemized
from netmodels.link_traces import QUANTITIES, Quantity
from netmodels.measured import TraceFile, measured
from netmodels.partial_trains import settle_without
from netmodels.queues import SenderQueues
from netmodels.radio.delivery import delivery
from netmodels.radio.rate_control import RateControl
from netmodels.radio.standards import STANDARDS, StandardName, chosen_rates, psdu_bytes
from netmodels.radio.thresholds import Thresholds
from netmodels.random_loss import REASONS, PairStreams, RandomLoss

_RATIO = -1  # no rate: a ratio is a chance, at any


class Replay(Itemized):
    """Links as they were measured: packets get lost by chance, as many as were lost then.

    ``file`` is a K7 file, or a CSV with the columns time_s, source, destination and delivery_ratio
    or rssi_dbm. A value holds until the next one of that link, the last one to the end; before its
    first row, and where the trace has no such link, the chance of a packet is ``otherwise``. If
    rows have channels and none is chosen, a packet is on each of them equally often. Or it is a
    survey, a CSV with x_m, y_m, node and the same values: between the node and a host, in both
    directions, those of the place that is nearest to the host count, however far it is (its rows
    equally often; between two nodes, the source's).

    An RSSI becomes a chance by the bit errors of ``standard`` for a packet of its size, as
    ``radio`` has them while nobody else is on the air; no RSSI is no signal. A unicast packet is
    then sent until it arrives, at most 7 times, at rates that its sender learns
    (``rate_control``), of which ``rate`` is the first; acknowledgements arrive. Broadcasts go once,
    at the lowest rate. Without ``rate_control``, and by delivery ratios, each packet goes once, at
    ``rate``. Packets are lost independently of each other.

    Each sender's frames go out one after another, and nobody hinders anybody else: delay = wait
    behind the sender's own earlier frames + size * 8 / rate, of each attempt, + latency.

    Capabilities: Itemizes, Separates, KnowsDepartures.
    """

    class Params(TraceFile):
        quantity: Quantity | None = Field(None, description=(
            "delivery_ratio or rssi_dbm, where a trace has both (the former)"))
        otherwise: Ratio = Field(0.0, description="chance of a packet where the trace says nothing "
                                                  "(none)")
        rate_bps: BitRate = Field("54 Mb/s", description="(802.11g nominal)")
        rate_control: RateControl | None = Field(RateControl(), description=(
            "of an RSSI, the rate for each receiver by what arrives, as the radio's (as stations "
            "do; null: always rate, and no repetitions)"))
        latency_ns: Duration = Field("0 ns", description="one way, after the last bit was sent "
                                                         "(none)")
        standard: StandardName = Field("11g", description="whose errors make a "
                                                       "chance of an RSSI (as the radio)")
        reception: Thresholds = Field(Thresholds(), description="of receivers, for an RSSI "
                                                                "(802.11-2016)")

    reasons = (*REASONS, "retry_limit")

    def __init__(self, params: Params) -> None:
        self._params = params

    def start(self, context: ports.Context, hosts: tuple[str, ...]) -> None:
        params = self._params
        self._context = context
        self._losses = RandomLoss(context, "replay", hosts)
        quantities = QUANTITIES if params.quantity is None else (params.quantity,)
        self._measured = measured(params, quantities, hosts, context)
        self._attempts, self._once, rate_bps = None, _RATIO, params.rate_bps
        if self._measured.column == "rssi_dbm":
            rate, lowest = chosen_rates(STANDARDS[params.standard], params.standard,
                                        params.rate_bps, None)
            self._errors = _by_errors(params)
            self._once = rate
            if params.rate_control is not None:
                standard = STANDARDS[params.standard]
                self._attempts = Attempts(params.rate_control, standard, rate,
                                          context.stream, self._ratio)
                self._draws = PairStreams(context, "attempts", hosts)
                self._once, rate_bps = lowest, round(1e6 * standard.rates[lowest].mbps)
        self._outlets = SenderQueues(len(hosts), rate_bps, self._ledger)

    def departure_ns(self, host: int) -> int:
        """``ports.KnowsDepartures``."""
        return self._outlets.departure_ns(host)

    def send(self, frame: ports.Frame) -> None:
        self._ledger.spent(frame, ports.TimePart.PROPAGATION, self._params.latency_ns)
        if self._attempts is not None and not frame.broadcast:
            self._send_until_it_arrives(self._attempts, frame)
            return
        size_bytes = psdu_bytes(frame.size_bytes, frame.segments)
        delay_ns = (self._outlets.delay_ns(frame, self._context.now_ns)
                    + self._params.latency_ns)
        self._losses.settle(frame, [self._now(frame.source, receiver, size_bytes, self._once)
                                    for receiver in frame.receivers], delay_ns)

    def _send_until_it_arrives(self, attempts: Attempts, frame: ports.Frame) -> None:
        source, (receiver,) = frame.source, frame.receivers
        draws = self._draws(source, receiver).random((frame.segments, TRIES))
        lost, sent_ns, repeated_ns = [], 0, 0
        for number, packet_bytes in enumerate(ports.packet_sizes(frame.size_bytes,
                                                                 frame.segments)):
            chance = partial(self._now, source, receiver, psdu_bytes(packet_bytes, 1))
            arrives, last_ns, before_ns = attempts.packet(source, receiver, packet_bytes,
                                                          self._context.now_ns, chance,
                                                          draws[number])
            sent_ns, repeated_ns = sent_ns + last_ns, repeated_ns + before_ns
            if not arrives:
                lost.append(number)
        delay_ns = self._outlets.taken_ns(frame, self._context.now_ns, sent_ns, repeated_ns)
        reason = "out_of_range" if self.separates(source, receiver) else "retry_limit"
        settle_without(self._context, frame, receiver, {reason: lost},
                       ports.Deliver(delay_ns + self._params.latency_ns))

    def separates(self, host: int, other: int) -> bool:
        """Whether no frame gets between the two now, however short."""
        return not self._now(host, other, 1, self._once)

    def _ratio(self, source: int, receiver: int) -> float:
        """The ratio of signal to noise that the trace has now, 0 where it says nothing."""
        values = self._measured.values(source, receiver, self._context.now_ns)
        noise_dbm = self._params.reception.for_stations().noise_dbm
        return sum(10 ** ((dbm - noise_dbm) / 10) for dbm in values) / max(len(values), 1)

    def _now(self, source: int, receiver: int, size_bytes: int, rate: int) -> float:
        """The chance of a packet at ``rate``, sent once."""
        values = self._measured.values(source, receiver, self._context.now_ns)
        if not values:
            return self._params.otherwise
        return sum(values if rate == _RATIO else (
            self._errors(value, size_bytes, rate) for value in values)) / len(values)


def _by_errors(params: Replay.Params) -> Callable[[float, int, int], float]:
    """The chance that a packet arrives, by its RSSI in dBm, its size in bytes and its rate."""
    standard, reception = STANDARDS[params.standard], params.reception.for_stations()
    return lru_cache(1 << 16)(lambda rssi_dbm, size_bytes, rate: float(
        delivery(rssi_dbm, standard, rate, size_bytes, reception)))
