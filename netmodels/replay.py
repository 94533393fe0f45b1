"""Measured links, played again."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from typing import Literal

from pydantic import Field

from desim import ports
from desim.errors import InputError, did_you_mean
from desim.units import BitRate, Duration, Ratio
from netmodels.itemized import Itemized
from netmodels.link_traces import LinkTraces, MeasuredLink, Quantity, read
from netmodels.queues import SenderQueues
from netmodels.radio.delivery import delivery
from netmodels.radio.standards import STANDARDS, chosen_rates, psdu_bytes
from netmodels.radio.thresholds import Thresholds
from netmodels.random_loss import REASONS, RandomLoss


class Replay(Itemized):
    """Links as a trace has them, wherever the hosts are: packets get lost by chance, as many as
    were lost during the measurement.

    ``file`` is a K7 file, or a CSV with the columns time_s, source, destination and delivery_ratio
    or rssi_dbm. A value holds until the next one of that link, the last one to the end; before its
    first row, and where the trace has no such link, the chance of a packet is ``otherwise``. If
    rows have channels and none is chosen, a packet is on each of them equally often. An RSSI
    becomes a chance by the bit errors of ``standard`` at ``rate`` for a packet of its size, as
    ``radio`` has them while nobody else is on the air; no RSSI is no signal. Packets are lost
    independently of each other.

    Each sender's frames go out one after another at ``rate``, and nobody hinders anybody else:
    delay = wait behind the sender's own earlier frames + size * 8 / rate + latency.

    Capabilities: Itemizes, Separates.
    """

    class Params(ports.Params):
        file: ports.File = Field(description="the trace, relative to the scenario that names it")
        nodes: dict[str, str | int] = Field({}, description="by host, its name in the trace (its "
                                                            "own)")
        quantity: Quantity | None = Field(None, description=(
            "delivery_ratio or rssi_dbm, where a trace has both (the former)"))
        channel: int | None = Field(None, description="rows of this one alone (all)")
        begin_ns: Duration = Field("0 s", description="the moment of the trace at which the run "
                                                      "begins (its beginning)")
        otherwise: Ratio = Field(0.0, description="chance of a packet where the trace says nothing "
                                                  "(none)")
        rate_bps: BitRate = Field("54 Mb/s", description="(802.11g nominal)")
        latency_ns: Duration = Field("0 ns", description="one way, after the last bit was sent "
                                                         "(none)")
        standard: Literal["11a", "11b", "11g"] = Field("11g", description="whose errors make a "
                                                       "chance of an RSSI (as the radio)")
        reception: Thresholds = Field(Thresholds(), description="of receivers, for an RSSI "
                                                                "(802.11-2016)")

    reasons = REASONS

    def __init__(self, params: Params) -> None:
        self._params = params

    def start(self, context: ports.Context, hosts: tuple[str, ...]) -> None:
        params = self._params
        self._context = context
        self._outlets = SenderQueues(len(hosts), params.rate_bps, self._ledger)
        self._losses = RandomLoss(context, "replay", hosts)
        try:
            trace = read(params.file, params.quantity, params.channel)
        except InputError as error:
            raise InputError(f".file: {error}") from None
        self._links = _between(hosts, params.nodes, trace)
        self._chance = (_by_errors(params) if trace.quantity == "rssi_dbm"
                        else lambda ratio, size_bytes: ratio)

    def departure_ns(self, host: int) -> int:
        """``ports.KnowsDepartures``."""
        return self._outlets.departure_ns(host)

    def send(self, frame: ports.Frame) -> None:
        size_bytes = psdu_bytes(frame.size_bytes, frame.segments)
        delay_ns = (self._outlets.delay_ns(frame, self._context.now_ns)
                    + self._params.latency_ns)
        if self._ledger is not None:
            self._ledger.spent(frame, ports.TimePart.PROPAGATION, self._params.latency_ns)
        self._losses.settle(frame, [self._now(frame.source, receiver, size_bytes)
                                    for receiver in frame.receivers], delay_ns)

    def separates(self, host: int, other: int) -> bool:
        """Whether no frame gets between the two now, however short."""
        return not self._now(host, other, 1)

    def _now(self, source: int, receiver: int, size_bytes: int) -> float:
        """The chance of a packet."""
        link = self._links.get((source, receiver))
        values = link.at(self._context.now_ns + self._params.begin_ns) if link else ()
        if not values:
            return self._params.otherwise
        return sum(self._chance(value, size_bytes) for value in values) / len(values)


def _by_errors(params: Replay.Params) -> Callable[[float, int], float]:
    """The chance that a packet arrives, by its RSSI in dBm and its size in bytes. Raises
    ``InputError`` for a rate that the standard does not have."""
    standard, reception = STANDARDS[params.standard], params.reception.for_stations()
    rate, _ = chosen_rates(params.standard, params.rate_bps, None)
    return lru_cache(1 << 16)(lambda rssi_dbm, size_bytes: float(
        delivery(rssi_dbm, standard, rate, size_bytes, reception)))


def _between(hosts: tuple[str, ...], nodes: dict[str, str | int], trace: LinkTraces
             ) -> dict[tuple[int, int], MeasuredLink]:
    """The links between hosts. Raises ``InputError`` for names that do not fit."""
    known = sorted({node for link in trace.links for node in link}, key=ports.natural_key)
    there = f"; it has {', '.join(known)}"
    host_of: dict[str, int] = {}
    for host, name in nodes.items():
        if host not in hosts:
            raise InputError(f".nodes: no host {host!r}{did_you_mean(host, hosts)}; hosts are "
                             f"{', '.join(hosts)}")
        if str(name) not in known:
            raise InputError(f".nodes.{host}: the trace has no node {str(name)!r}{there}")
    for index, host in enumerate(hosts):
        node = str(nodes.get(host, host))
        if node in host_of:
            raise InputError(f".nodes.{host}: node {node!r} is host {hosts[host_of[node]]!r} "
                             "already")
        host_of[node] = index
    links = {(host_of[source], host_of[destination]): link
             for (source, destination), link in trace.links.items()
             if source in host_of and destination in host_of}
    if not links:
        raise InputError(f".nodes: the trace has no link between two hosts{there}; hosts are "
                         f"{', '.join(hosts)}")
    return links
