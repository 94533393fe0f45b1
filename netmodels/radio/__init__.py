"""Radios of IEEE 802.11a, b or g, without an access point."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field, model_validator

from desim import ports
from desim.errors import InputError
from desim.units import BitRate, ByteSize, Decibels, Level, Period
from netmodels.ethernet import FULL_BYTES
from netmodels.radio.budget import Budget
from netmodels.radio.channels import channels_of
from netmodels.radio.dcf import (
    ACKED,
    EXPIRED,
    FAILED,
    HEARD,
    NEVER,
    RECEIVED,
    Reception,
    Stations,
)
from netmodels.radio.delivery import mean_delivery
from netmodels.radio.errors import error_table
from netmodels.radio.fading import Fades, Fading
from netmodels.radio.fates import Waiting
from netmodels.radio.pathloss import PathLoss, PathLossParams, reach_m
from netmodels.radio.presets import filled
from netmodels.radio.ratecontrol import Arf, RateControl
from netmodels.radio.rates import chosen_rates
from netmodels.radio.shadowing import Shadowing, Shadows
from netmodels.radio.standards import MOST_BYTES, STANDARDS, Standard, psdu_bytes
from netmodels.radio.walls import Walls

_THERMAL_DBM = -100.965  # k T B of 20 MHz at 290 K

_EXPIRED = ports.Drop("expired")
_ATTEMPTS = {ACKED: Arf.acknowledged, FAILED: Arf.failed}


class Thresholds(ports.Params):
    """What a receiver makes of what it hears."""

    noise_figure_db: Decibels = Field("7 dB", description="noise of the receiver itself (ns-3; "
                                                          "802.11-2016, 17.3.10.2, allows 15 dB)")
    heard_dbm: Level = Field("-101 dBm", description="what is weaker is not even interference "
                                                     "(ns-3: RxSensitivity; 7 dB below the noise)")
    energy_dbm: Level = Field("-62 dBm", description=(
        "whatever it is, it makes the medium busy (802.11-2016, 17.3.10.6; preset ns3_3_44: -82 "
        "dBm)"))
    preamble_dbm: Level | None = Field(None, description=(
        "the least that a frame is found at, and makes the medium busy (null: none but "
        "preamble_above, with which that is -90 dBm; 802.11-2016, 17.3.10.6, asks for -82 dBm or "
        "better, and receivers are better; preset ns3_3_44: -82 dBm)"))
    preamble_above_db: Decibels = Field("4 dB", description=(
        "how far a frame must be above noise and interference to be found (ns-3)"))
    unaware: bool = Field(False, description=(
        "interference that began within 4 us of a frame does it no harm (no receiver is like that, "
        "but ns-3's)"))

    @property
    def found_dbm(self) -> float:
        """The least that a frame is found at where nobody else is on the air."""
        above_noise_dbm = _THERMAL_DBM + self.noise_figure_db + self.preamble_above_db
        if self.preamble_dbm is None:
            return above_noise_dbm
        return max(above_noise_dbm, self.preamble_dbm)

    def for_stations(self) -> Reception:
        return Reception(_THERMAL_DBM + self.noise_figure_db, self.energy_dbm, self.found_dbm,
                         self.preamble_above_db, unaware=self.unaware)


class Radio:
    """Wi-Fi without an access point (802.11a, b or g): carrier sense, backoff, acknowledgements and
    retries of unicast frames, none of broadcast ones; hidden terminals, and capture of the stronger
    frame. Who is on another channel hears nothing of it, and a host with several radios has a
    medium for each; two media never hear each other.

    A broadcast fails at a receiver that is too far to find it (``out_of_reach``), that was sending
    or listening to somebody else or found it under others (``collision``), or that made out its
    beginning but not all of it (``channel_error``). Propagation (0.7 us over 200 m) is left out.
    A train is sent packet by packet; one that is given up, or that a receiver of a broadcast does
    not get, is lost alone. The train has arrived when the last packet is through.

    Rules of loss and jamming act on each transmission of data, so that it is repeated; what they
    take is like what has errors. Acknowledgements and RTS get through.

    Where links fade (``fading``), their gains change at the beginning of a block, also for what is
    on the air then. With ``rate_control`` a rate belongs to a sender and a receiver, and packets
    have it from the attempt on that follows the change.

    Received powers are those of the places at a moment at most ``update`` ago, and of the present
    walls and doors; they are looked at when something is sent or decided. A host without a place
    hears nobody, and nobody hears it, unless the path loss is ``fixed``.
    """

    class Params(ports.Params):
        preset: Literal["ns3_3_44"] | None = Field(None, description=(
            "values for what is not given: ns3_3_44, as in ns-3 3.44 with the error model of NIST "
            "(none: 802.11-2016)"))
        standard: Literal["11a", "11b", "11g"] = Field("11g", description="timing and rates (2.4 "
                                                                          "GHz as most robots)")
        rate_bps: BitRate = Field("54 Mb/s", description="of unicast frames (802.11g nominal)")
        broadcast_rate_bps: BitRate | None = Field(None, description=(
            "of broadcast frames (the lowest of the same modulation; ns-3: of all)"))
        rate_control: RateControl | None = Field(None, description=(
            "learns from acknowledgements how fast to send to whom, of the rates of the same "
            "modulation as rate, which is the first (none: always rate)"))
        channel: int = Field(1, ge=1, le=196, description="its number: who is on different ones "
                                                          "does not hear the other (the first)")
        channels: dict[str, Annotated[int, Field(ge=1, le=196)]] = Field(
            {}, description="by host, instead of channel (none)")
        power_dbm: Level = Field("16.0206 dBm", description="sent, antennas included (ns-3: 40 mW)")
        path_loss: PathLossParams = Field(PathLossParams(), description=(
            "model: log_distance, free_space, two_ray, itu_p1238 or fixed, with its parameters "
            "(log_distance, ns-3's, whose first metre is as in free space)"))
        walls: Walls | None = Field(Walls(), description="what walls cost (null: nothing)")
        shadowing: Shadowing | None = Field(None, description="log-normal, of what is not drawn "
                                                              "(none; ns-3)")
        fading: Fading | None = Field(None, description="by echoes, Rayleigh or Rician, in blocks "
                                                        "(none; ns-3)")
        reception: Thresholds = Field(Thresholds(), description="of receivers (802.11-2016)")
        queue: int = Field(500, ge=1, le=10_000, description="frames that wait at a sender, "
                                                              "a train being one (ns-3: packets)")
        lifetime_ns: Period | None = Field(None, description=(
            "a frame that waits longer at its sender is dropped as expired (none; ns-3: 500 ms)"))
        retries: int = Field(7, ge=1, le=255, description="transmissions before a frame is given "
                                                          "up (802.11: dot11ShortRetryLimit)")
        window_failures: int | None = Field(None, ge=1, le=255, description=(
            "failures in a row that let a sender's contention window start anew (as many as "
            "retries: when a frame is given up, 802.11-2016, 10.3.3; ns-3: 8)"))
        rts_bytes: ByteSize | None = Field(None, description=(
            "packets on the air above this size ask first, those of a train if its first one does "
            "(null: none)"))
        update_ns: Period = Field("100 ms", description="between looks at where everybody is "
                                                        "(0.12 m at 1.2 m/s)")

        @model_validator(mode="before")
        @classmethod
        def _filled(cls, given: Any) -> Any:
            return filled(given)

        def loss(self) -> PathLoss:
            """The path loss on the channel."""
            return self.path_loss.chosen(STANDARDS[self.standard].carrier_hz(self.channel))

    reasons = ("channel_error", "collision", "expired", "out_of_reach", "queue_full", "retry_limit")
    refuses = ("queue_full",)
    judges_transmissions = True

    def __init__(self, params: Params, standard: Standard | None = None) -> None:
        """``standard``: its numbers, where they are not those of the one in ``params``."""
        self._params = params
        self._standard = standard or STANDARDS[params.standard]
        best_db = sum(slot.best_db for slot in (params.shadowing, params.fading) if slot)
        self.reach_m = reach_m(params.loss(),
                               params.power_dbm + best_db - params.reception.found_dbm)
        if params.channels:
            self.separates = self._on_different_channels

    def start(self, context: ports.Context, hosts: tuple[str, ...]) -> None:
        params, standard = self._params, self._standard
        self._context = context
        self._judged = context.judge_transmission is not None
        self._rate, self._broadcast_rate = chosen_rates(
            params.standard, params.rate_bps, params.broadcast_rate_bps)
        if params.walls is not None:
            params.walls.check(context.obstacles.materials)
        self._budget = Budget(
            params.power_dbm, params.loss(), params.walls,
            params.shadowing and Shadows(params.shadowing, hosts, context.stream),
            self._heard_dbm(), params.reception.found_dbm,
            channels_of(hosts, params.channel, params.channels, standard))
        self._fades = params.fading and Fades(
            params.fading, hosts, context.stream, standard.carrier_hz(params.channel),
            params.reception.found_dbm)
        keys = np.array([context.stream("backoff", host).integers(2 ** 64, dtype=np.uint64)
                         for host in hosts], np.uint64)
        errors = error_table(tuple(rate.mbps for rate in standard.rates))
        self._stations = Stations(standard, keys, errors, params.reception.for_stations(),
                                  params.queue, params.retries,
                                  params.window_failures or params.retries, params.lifetime_ns,
                                  first_rate=params.rate_control and self._rate,
                                  judged=self._judged)
        self._arf = params.rate_control and Arf(params.rate_control, standard.alike(self._rate),
                                                self._rate)
        self._waiting: dict[tuple[int, int], Waiting] = {}  # by station and place in its queue
        self._looked_ns, self._places, self._epoch = 0, None, None
        self._settled_ns = -1
        self._look_booked = False
        self._wake: Any = None
        self._wake_ns = NEVER

    def _heard_dbm(self) -> float:
        """What is weaker on the average is nobody's business: neither interference, nor found when
        it fades up."""
        heard_dbm, fading = self._params.reception.heard_dbm, self._params.fading
        if fading is None:
            return heard_dbm
        return min(heard_dbm, self._params.reception.found_dbm - fading.best_db)

    def signal(self, from_m: np.ndarray, to_m: np.ndarray) -> ports.Signal:
        """``ports.NetworkModel``: of unicast packets, one attempt each; where it fades, means."""
        power_dbm = self._budget.received_dbm(from_m, to_m, self._context.obstacles)
        return ports.Signal(power_dbm, self._share(power_dbm))

    def _share(self, power_dbm: np.ndarray) -> np.ndarray:
        """Of full packets that get through, each sent once; with rate control at the slowest rate
        that there is to fall back to."""
        params = self._params
        rate = self._standard.lowest(self._rate) if params.rate_control else self._rate
        return mean_delivery(power_dbm, self._standard, rate, psdu_bytes(FULL_BYTES, 1),
                             params.reception.for_stations(), params.fading)

    def busy_ns(self, hosts: Sequence[int]) -> list[int]:
        """``ports.NetworkModel``: for how long each of ``hosts`` was sending, or carrier sense told
        it that somebody was. What is merely reserved (802.11's NAV) is not busy."""
        return self._stations.busy_ns(self._context.now_ns)[list(hosts)].tolist()

    def attempts(self) -> tuple[int, int]:
        """Transmissions of data so far, and how many transmissions had no reply (of RTS too)."""
        now_ns = self._context.now_ns
        if self._settled_ns != now_ns:
            self._settle(now_ns)
        counts = self._stations.counts(now_ns)
        return int(counts.transmitted.sum()), int(counts.failures.sum())

    def _on_different_channels(self, host: int, other: int) -> bool:
        return self._budget.channels[host] != self._budget.channels[other]

    def links(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """From whom [k] to whom [k] a full packet gets that is sent once, and with which chance [k]
        while nobody else is on the air."""
        context = self._context
        links = self._budget.links(context.positions(context.now_ns), context.obstacles)
        share = self._share(10 * np.log10(links.mw))
        found = share > 0.0
        return links.source()[found], links.hearer[found], share[found]

    def send(self, frame: ports.Frame) -> None:
        """Raises ``InputError`` for a packet that 802.11 has no frame for."""
        sizes = ports.packet_sizes(frame.size_bytes, frame.segments)
        if sizes[0] > MOST_BYTES:
            raise InputError(f"a packet of {sizes[0]} B is too long for 802.11; at most "
                             f"{MOST_BYTES} B with Ethernet's headers")
        context = self._context
        now_ns = context.now_ns
        if self._settled_ns != now_ns:
            self._settle(now_ns)
        size_bytes = psdu_bytes(sizes[0], 1)
        if frame.broadcast:
            dest, rate, rts = -1, self._broadcast_rate, False
        else:
            limit = self._params.rts_bytes
            dest, rate = frame.receivers[0], self._rate
            rts = limit is not None and size_bytes > limit
        position = self._stations.enqueue(now_ns, frame.source, dest, size_bytes, rate,
                                          frame.segments, psdu_bytes(sizes[-1], 1), rts)
        self._book_look()
        if position is None:
            context.settle_many(frame, frame.receivers, ports.Drop("queue_full"))
        else:
            self._waiting[frame.source, position] = Waiting(frame)

    def _book_look(self) -> None:
        """Once for all that is sent in this instant, also by those who are told something now."""
        if not self._look_booked:
            self._look_booked = True
            self._context.at(self._context.now_ns, self._look_ahead)

    def _look_ahead(self, _: Any) -> None:
        """Be there when the next frame's fate is decided."""
        self._look_booked = False
        next_ns = int(self._stations.next_ns)
        if self._fades is not None and next_ns < NEVER:
            next_ns = min(next_ns, self._fades.until_ns)
        if next_ns == self._wake_ns:
            return
        if self._wake is not None:
            self._wake.cancel()
        self._wake_ns = next_ns
        self._wake = None if next_ns >= NEVER else self._context.at(next_ns, self._wake_up)

    def _wake_up(self, _: Any) -> None:
        self._wake, self._wake_ns = None, NEVER
        self._settle(self._context.now_ns)
        self._book_look()

    def _settle(self, now_ns: int) -> None:
        """Take what has been decided by now, see who is where, then tell. (Whoever is told may send
        again at once, and a new frame may have the place of one in question.)"""
        self._settled_ns = now_ns
        decided = []
        for _, what, station, position, receiver, packet in self._stations.advance(now_ns):
            if what in _ATTEMPTS:
                self._stations.choose(station, receiver,
                                      _ATTEMPTS[what](self._arf, station, receiver))
                continue
            waiting = self._waiting[station, position]
            if self._judged and what in (HEARD, RECEIVED):
                if not self._passes(waiting, what, receiver, packet):
                    continue
                what = RECEIVED
            if waiting.note(what, receiver, packet):
                del self._waiting[station, position]
                decided.append((what, waiting))
        self._look_around(now_ns)
        for what, waiting in decided:
            self._tell(what, waiting)

    def _look_around(self, now_ns: int) -> None:
        """Links from where the hosts are, if that may have changed and it is time."""
        places, obstacles, fades = (self._context.positions(now_ns), self._context.obstacles,
                                    self._fades)
        if obstacles.epoch != self._epoch or (
                places is not self._places
                and now_ns >= self._looked_ns + self._params.update_ns):
            self._looked_ns, self._places, self._epoch = now_ns, places, obstacles.epoch
            self._mean = self._budget.links(places, obstacles)
        elif fades is None or now_ns < fades.until_ns:
            return
        self._links = links = self._mean if fades is None else fades.links(self._mean, now_ns)
        self._stations.link(now_ns, links.first, links.hearer, links.mw)

    def _tell(self, what: int, waiting: Waiting) -> None:
        frame = waiting.frame
        if what == EXPIRED:
            self._context.settle_many(frame, frame.receivers, _EXPIRED)
        elif frame.broadcast:
            waiting.tell_all(self._context, self._links.finders(frame.source))
        else:
            waiting.tell(self._context)

    def _passes(self, waiting: Waiting, what: int, receiver: int, packet: int) -> bool:
        """Whether a packet that was made out at ``receiver`` is not lost by rules, and to be noted:
        any one of a broadcast, and the last one of a train when it comes for the first time."""
        frame, now_ns = waiting.frame, self._context.now_ns
        if what == RECEIVED and not frame.among((receiver,)):
            return True
        drop = self._context.judge_transmission(waiting.packet(packet, receiver), receiver)
        if what == HEARD:
            first = self._stations.judge(now_ns, frame.source, drop is not None)
            return first and packet == frame.segments - 1
        if drop is not None:
            waiting.lose(drop.reason, receiver, packet)
            self._stations.miss(now_ns, receiver)
        return drop is None
