"""The whole radio of IEEE 802.11 without an access point, with contention."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from math import inf, log10
from typing import Annotated, ClassVar, Literal, Self

import numpy as np
from pydantic import Field, model_validator

from desim import ports
from desim.errors import InputError
from desim.units import BitRate, ByteSize, Level, Period
from netmodels.ethernet import FULL_BYTES
from netmodels.queues import refuse
from netmodels.radio.access_categories import (
    BEACON_MARK,
    BEACONS,
    categories,
    of_hostapd,
    rank_of,
)
from netmodels.radio.air import Air, Airs
from netmodels.radio.body_loss import BodyLoss
from netmodels.radio.budget import Budget
from netmodels.radio.cards import CARDS
from netmodels.radio.dcf.stations import Aggregation, Reception
from netmodels.radio.delivery import mean_delivery
from netmodels.radio.fading import Fading
from netmodels.radio.modulation import USUAL_HZ, Modulation
from netmodels.radio.path_loss import LIGHT_MPS, PathLoss, PathLossParams, reach_m
from netmodels.radio.presets import filled
from netmodels.radio.rate_control import RateControl
from netmodels.radio.shadowing import Shadowing, Shadows
from netmodels.radio.standards import Access, Standard, channels_of, psdu_bytes, train_bytes
from netmodels.radio.thresholds import IDLE_DBM, Thresholds
from netmodels.radio.walls import Walls


class AccessConstants(ports.Constants):
    """Rules of a station's access to the medium, which preset ns3_3_44 changes."""

    lifetime_ns: Period | None = Field(None, description=(
        "a packet that is not through after this time is dropped as expired, also while it is "
        "repeated (none; ns-3: 500 ms)"))
    window_failures: int | None = Field(None, ge=1, le=255, description=(
        "failures in a row that let a sender's contention window start anew (as many as "
        "retries: when a frame is given up, 802.11-2016, 10.3.3; ns-3: 8)"))
    difs_first: bool = Field(False, description=(
        "a packet that comes while the medium is idle waits for DIFS from then on, and needs "
        "no backoff if that becomes busy (as ns-3; 802.11-2016, 10.3.4.2: it goes when that "
        "has been idle for DIFS, perhaps at once, and with a backoff if it is busy before)"))
    edca: Literal["hostapd", "stations"] = Field("hostapd", description=(
        "access of access points' own categories: hostapd, whose best effort has windows up to 63 "
        "and whose video and voice have AIFS of one slot, or that of stations (ns-3)"))
    block_endless: bool = Field(False, description=(
        "what may go as an aggregate is repeated until it arrives, up to 200 times (as ns-3, for "
        "500 ms, and 802.11-2016, 10.22.2.11.1; cards give it up after retries)"))
    block_requests: bool = Field(False, description=(
        "who misses a block acknowledgement sends a request for it before anything else (as ns-3; "
        "cards send the packets again)"))
    apart: bool = Field(False, description=(
        "a packet of an aggregate arrives when it is over itself, unless rules judge it (as ns-3; "
        "with the aggregate)"))
    aggregate_packets: int = Field(64, ge=1, le=256, description=(
        "most of an aggregate, of 11ax up to 256 (64 of a block acknowledgement, 802.11-2016, "
        "9.3.1.9.3; ns-3: 256 with 11ax)"))
    aggregate_bytes: ByteSize = Field("65535 B", ge=1, description=(
        "most of an aggregate (HT, 802.11-2016, 19.3.24; ns-3, also of VHT and HE)"))


class DcfRadio:
    """Wi-Fi without an access point (802.11a, b, g, n, ac, ax): carrier sense, backoff,
    acknowledgements and retries of unicast frames, none of broadcast ones; hidden terminals, and
    capture of the stronger frame. A host with several radios has a medium for each. Media that
    have a channel in common share the air: they contend with each other and are interference for
    each other, and no frame of one is for the other. Radios on other channels hear nothing of it.

    A broadcast fails at a receiver that is too far to find it (``out_of_reach``), that was sending
    or listening to another one or found it under others (``collision``), or that made out its
    beginning but not all of it (``channel_error``). Signals arrive without delay (really 0.7 us
    over 200 m); with ``unaware`` the distances decide which of two frames that were sent in one
    slot comes first.
    A train is sent packet by packet; one that is given up, or that a receiver of a broadcast does
    not get, is lost alone. The train has arrived when the last packet is through.

    802.11n, ac and ax (``mcs``): all is best effort, with AIFS of three slots. What waits for one
    receiver goes as an aggregate (A-MPDU) of up to 64 packets, 65535 B and 5.484 ms, each with
    errors of its own; a block acknowledgement says which to repeat. With ``amsdu`` packets in a row
    go as one, alone or in an aggregate, but for rules, which judge each. Broadcasts go alone, at a
    rate of 802.11a. Frames arrive in the order in which they were sent.

    Rules of loss and jamming act on each transmission of data, so that it is repeated; what they
    take is like what has errors. Acknowledgements and RTS get through.

    Where links fade (``fading``), their gains change from step to step of 1 ms, also for what is
    on the air then. With ``rate_control`` a rate belongs to a sender and a receiver, and packets
    have it from the attempt on that follows the change.

    Drawn walls count once: between walls that cost something the path loss is that in sight, unless
    ``path_loss`` says otherwise. Shadowing and its ``echoes`` belong to places.

    Received powers are those of the places at a moment at most ``update`` ago, and of the present
    walls and doors; they are updated when a frame is sent or settled. A host without a place
    hears nobody, and nobody hears it, unless the path loss is ``fixed``.

    Capabilities: LimitsReach, Retransmits, Refuses, CountsAttempts, CountsBusyTime, CountsAirtime,
    Itemizes, KnowsLinks, PredictsSignal, HearsAntennas; with ``channels``, Separates.
    """

    class Params(Modulation):
        meanings: ClassVar[Mapping[str, Mapping[str, ports.Named]]] = {"card": CARDS}

        preset: Literal["indoor", "outdoor", "ns3_3_44"] | None = Field(None, description=(
            "values for what neither the scenario nor the card gives: indoor and outdoor, path "
            "loss in sight and shadowing as measured (docs/defaults.md); ns3_3_44, as in ns-3 "
            "3.44 with the error model of NIST (none: 802.11-2016, with ns-3's path loss)"))
        card: Literal["pi_4", "intel_8265", "intel_ax200", "11g_2008", "esp_now"] | None = Field(
            None, description=(
            "standard, channel, width, streams, power and rates of one that can be bought, where "
            "they are not given (none: each parameter's default)"))
        rate_bps: BitRate = Field("54 Mb/s", description="of unicast frames of 11a, 11b, 11g "
                                                    "(802.11g nominal)")
        broadcast_rate_bps: BitRate | None = Field(None, description=(
            "of broadcast frames (the lowest of the same modulation; ns-3: of all)"))
        basic_rates_bps: tuple[BitRate, ...] | None = Field(None, min_length=1, description=(
            "that everybody understands: replies go at the highest one of the same modulation that "
            "is not above the frame's (the standard's mandatory ones: 802.11-2016, 10.7.6.5; as "
            "ns-3, and as Linux does ad hoc)"))
        rate_control: RateControl | None = Field(None, description=(
            "learns from acknowledgements how fast to send to whom: minstrel_ht, of all; else "
            "of the rates of the same modulation as rate, which is the first (none: always rate)"))
        channel: int = Field(1, ge=1, le=196, description=(
            "its number: who is on different ones does not hear the other (the first of the band: "
            "36 with 11a and 11ac)"))
        channels: dict[str, Annotated[int, Field(ge=1, le=196)]] = Field(
            {}, description="by host, instead of channel (none)")
        power_dbm: Level = Field("16.0206 dBm", description="sent, antennas included (ns-3: 40 mW)")
        path_loss: PathLossParams = Field(PathLossParams(), description=(
            "model: log_distance, free_space, two_ray, itu_p1238 or fixed, with its parameters "
            "(log_distance, ns-3's, whose first metre is as in free space)"))
        walls: Walls | None = Field(Walls(), description="what walls cost (null: nothing)")
        people: bool = Field(True, description="who stand on the line between two antennas weaken "
                                               "the signal (3GPP TR 38.901, 7.6.4.2)")
        shadowing: Shadowing | None = Field(None, description="log-normal, of what is not drawn "
                                                              "(none; ns-3)")
        fading: Fading | None = Field(None, description="by echoes, Rayleigh or Rician (none; "
                                                        "ns-3)")
        reception: Thresholds = Field(Thresholds(), description="of receivers (802.11-2016)")
        queue: int = Field(500, ge=1, le=10_000, description="packets that wait at a sender "
                                                              "(ns-3)")
        retries: int = Field(7, ge=1, le=255, description="transmissions before a frame is given "
                                                          "up (802.11: dot11ShortRetryLimit)")
        constants: AccessConstants = Field(AccessConstants(), description=(
            "single ones that differ (802.11-2016)"))
        rts_bytes: ByteSize | None = Field(None, description=(
            "packets on the air above this size ask first, those of a train if its first one does "
            "(null: none)"))
        update_ns: Period = Field("100 ms", description="between updates of the hosts' places "
                                                        "(0.12 m at 1.2 m/s)")

        @model_validator(mode="before")
        @classmethod
        def _filled(cls, given: object) -> object:
            return filled(given)

        def of_standard(self) -> Standard:
            """The standard's numbers. Raises ``InputError`` for what it does not have."""
            control = self.rate_control
            if control is not None:
                control.check(self.has_mcs)
            return self.of_channel(self.channel, self.basic_rates_bps,
                                   control is not None and control.all_streams)

        def rates(self) -> tuple[int, int]:
            """The rates of unicast and of broadcast frames, as indices of the standard's. Raises
            ``InputError`` for those that it does not have."""
            return self.rates_of(self.of_standard(), self.rate_bps, self.broadcast_rate_bps)

        def check_radio(self, hosts: tuple[str, ...]) -> None:
            """Raises ``InputError`` for what does not fit together, or to the hosts."""
            self.rates()
            self.aggregated()
            self.channel_numbers(hosts)

        def channel_numbers(self, hosts: tuple[str, ...]) -> np.ndarray:
            """[hosts] their channels. Raises ``InputError`` for those that there are not."""
            return channels_of(hosts, self.channel, self.channels, self.of_standard())

        def receiver(self) -> Reception:
            """Thresholds and noise in the channel's width."""
            found, wider_db = self.reception.for_stations(), 10 * log10(self.width_hz / USUAL_HZ)
            if not wider_db:
                return found
            noise_dbm = found.noise_dbm + wider_db
            deaf = self.standard == "11ax" and self.reception.constants.idle_after_sending
            return replace(
                found, noise_dbm=noise_dbm, idle_dbm=IDLE_DBM if deaf else -inf,
                preamble_dbm=max(found.preamble_dbm, noise_dbm + found.preamble_db))

        def aggregated(self) -> Aggregation | None:
            """The limits of aggregates; None: each packet goes alone."""
            if not (self.has_mcs and self.aggregation):
                return None
            most = 256 if self.standard == "11ax" else 64
            if self.constants.aggregate_packets > most:
                raise InputError(".constants.aggregate_packets: "
                                 f"{self.standard} has at most {most}")
            return Aggregation(packets=self.constants.aggregate_packets,
                               size_bytes=self.constants.aggregate_bytes, rts_bytes=self.rts_bytes,
                               amsdu_bytes=self.amsdu_bytes or 0,
                               endless=self.constants.block_endless,
                               requests=self.constants.block_requests,
                               apart=self.constants.apart)

        def loss(self) -> PathLoss:
            """The path loss on the channel."""
            return self.path_loss.chosen(self.of_standard().carrier_hz(self.channel))

        def beside(self, obstacles: ports.Obstacles) -> Self:
            """The same in a terrain with these walls, which do not count twice: their loss is not
            in the exponent, too."""
            if self.walls is None or not len(obstacles.segments):
                return self
            return self.model_copy(update={"path_loss": self.path_loss.beside_walls()})

        def shadows(self, context: ports.Context, hosts: tuple[str, ...]) -> Shadows | None:
            """The shadowing between ``hosts``, if there is one."""
            if self.shadowing is None:
                return None
            carrier_hz = self.of_standard().carrier_hz(self.channel)
            return Shadows(self.shadowing, hosts, context.stream, LIGHT_MPS / carrier_hz)

        def budget(self, context: ports.Context, hosts: tuple[str, ...], heard_dbm: float,
                   found_dbm: float) -> Budget:
            """The link budget of ``hosts``. Raises ``InputError`` for materials of walls and for
            channels that there are not."""
            if self.walls is not None:
                self.walls.check(context.obstacles.materials)
            return Budget(
                self.power_dbm, self.loss(), self.walls, self.shadows(context, hosts),
                heard_dbm, found_dbm,
                self.channel_numbers(hosts), context.antennas,
                BodyLoss(LIGHT_MPS / self.of_standard().carrier_hz(self.channel))
                if self.people else None)

    reasons: tuple[str, ...] = ("channel_error", "collision", "expired", "out_of_reach",
                                "queue_full", "retry_limit")
    refuses = ("queue_full",)
    judges_transmissions = True
    air: Air  # that it shares, once it has started
    ledger: ports.Ledger | None = None

    def __init__(self, params: Params, standard: Standard | None = None,
                 access_points: Collection[str] = ()) -> None:
        """``standard``: its numbers, where they are not those of the one in ``params``.
        ``access_points``: hosts that are."""
        self.params = params
        self.standard = standard or params.of_standard()
        qos_bytes = self.standard.qos_bytes
        self.categories = categories(self.standard) if qos_bytes else ()
        self._of_access_points = of_hostapd(self.standard) if (
            qos_bytes and params.constants.edca == "hostapd") else self.categories
        self._access_points = frozenset(access_points)
        self._more_bytes = qos_bytes + self.standard.alone_bytes, qos_bytes  # to one, and to all
        self.reach_m = self._reach_m(params.power_dbm)
        if params.channels:
            self.separates = self._on_different_channels

    def itemize(self, ledger: ports.Ledger) -> None:
        self.ledger = ledger

    def start(self, context: ports.Context, hosts: tuple[str, ...]) -> None:
        self.params = params = self.params.beside(context.obstacles)
        self.context, self.hosts = context, hosts
        self._dscp = context.dscp
        params.check_radio(hosts)
        self.rate, self._broadcast_rate = params.rates()
        self.budget = params.budget(context, hosts, self._heard_dbm(),
                                    params.receiver().preamble_dbm)
        self.reach_m = self._reach_m(self.budget.strongest_dbm)
        context.shared("radio", Airs).join(self)

    def _reach_m(self, power_dbm: float) -> float:
        params = self.params
        best_db = sum(slot.best_db for slot in (params.shadowing, params.fading) if slot)
        return reach_m(params.loss(), power_dbm + best_db - params.receiver().preamble_dbm)

    @cached_property
    def _air(self) -> Air:
        """The air that it shares, once all have joined."""
        self.air.open()
        return self.air

    @cached_property
    def _number(self) -> int:
        """This radio's index among those that share the air."""
        return self._air.radios.index(self)

    def _heard_dbm(self) -> float:
        """Mean power below which a signal is ignored: too weak to interfere, and too weak to be
        found even in its best fade."""
        heard_dbm, fading = self.params.reception.constants.heard_dbm, self.params.fading
        if fading is None:
            return heard_dbm
        return min(heard_dbm, self.params.receiver().preamble_dbm - fading.best_db)

    def signal(self, from_m: np.ndarray, to_m: np.ndarray) -> ports.Signal:
        """``ports.PredictsSignal``: of unicast packets, one attempt each; means over fading."""
        power_dbm = self.budget.received_dbm(from_m, to_m, self.context.obstacles)
        return ports.Signal(power_dbm, self._share(power_dbm))

    def link_signal(self, sender: int, receiver: int, ends_m: np.ndarray,
                    obstacles: ports.Obstacles) -> ports.Signal:
        """``ports.HearsAntennas``, as ``signal``."""
        power_dbm = self.budget.link_dbm(sender, receiver, ends_m, obstacles)
        return ports.Signal(power_dbm, self._share(power_dbm))

    def _share(self, power_dbm: np.ndarray) -> np.ndarray:
        """Probability that a full packet gets through at each power, sent once; with rate control
        at the slowest rate."""
        params = self.params
        rate = self.standard.lowest(self.rate) if params.rate_control else self.rate
        return mean_delivery(power_dbm, self.standard, rate, psdu_bytes(FULL_BYTES, 1),
                             params.receiver(), params.fading)

    def _rank(self, dscp: int) -> int | None:
        """The rank of a mark's category; None without a mark."""
        if dscp == BEACON_MARK:
            return BEACONS.rank
        return rank_of(dscp) if dscp and self.categories else None

    def access_of(self, host: str, rank: int | None = None) -> Access:
        """A host's access to the medium for packets of this rank (None: that have no mark)."""
        if rank == BEACONS.rank:
            return BEACONS
        usual = self.params.access(self.standard)
        if not self.categories:
            return usual
        own = self._of_access_points if host in self._access_points else self.categories
        return own[usual.rank if rank is None else rank]

    def busy_ns(self, hosts: Sequence[int]) -> list[int]:
        """For how long each of ``hosts`` was sending or its carrier sense was busy. The medium is
        not busy where it is merely reserved (802.11's NAV)."""
        return [sent_ns + heard_ns for sent_ns, heard_ns in self.airtime_ns(hosts)]

    def airtime_ns(self, hosts: Sequence[int]) -> list[tuple[int, int]]:
        """For how long each of ``hosts`` was sending frames of any kind, and for how long its
        carrier sense found others sending."""
        sent_ns, busy_ns = self._air.stations.airtimes_ns(self.context.now_ns)
        first = self._number * len(self.budget.channels)
        return [(int(sent_ns[first + host]), int(busy_ns[first + host] - sent_ns[first + host]))
                for host in hosts]

    def attempts(self) -> tuple[int, int]:
        """Transmissions of data so far, and how many transmissions had no reply (of RTS too)."""
        self._air.catch_up()
        counts, hosts = self._air.stations.counts(self.context.now_ns), len(self.budget.channels)
        own = slice(self._number * hosts, (self._number + 1) * hosts)
        return int(counts.transmitted[own].sum()), int(counts.failures[own].sum())

    def tune(self, host: int, channel: int) -> None:
        """Let a host be on another channel from now on: one that a radio has been on from the
        start, or 0, where it hears nobody. Not from the settlement of a frame."""
        self.budget.channels[host] = channel
        self._air.tune(self._number, host, channel)

    def powers_dbm(self) -> np.ndarray:
        """[hosts, hosts] dBm of each host at each other one, on whatever channels they are, when
        links were last made anew; -inf where it cannot be heard. Without fading."""
        return self._air.powers_dbm(self._number)

    def _on_different_channels(self, host: int, other: int) -> bool:
        return self.budget.channels[host] != self.budget.channels[other]

    def links(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """``ports.KnowsLinks``: of full packets that are sent once while nobody else is on the air.
        """
        context = self.context
        links = self.budget.links(context.positions(context.now_ns), context.obstacles)
        share = self._share(10 * np.log10(links.mw))
        found = share > 0.0
        return links.source()[found], links.hearer[found], share[found]

    def send(self, frame: ports.Frame) -> None:
        """Raises ``InputError`` for a packet that 802.11 has no frame for."""
        size_bytes, last_bytes = train_bytes(frame.size_bytes, frame.segments,
                                             self._more_bytes[frame.broadcast])
        rate, rts = self._broadcast_rate, False
        if not frame.broadcast:
            limit = self.params.rts_bytes
            rate, rts = self.rate, limit is not None and size_bytes > limit
        rank = None if self._dscp is None else self._rank(self._dscp(frame))
        fit = self._air.send(self._number, frame, size_bytes, last_bytes, rate, rts, rank)
        if fit < frame.segments:
            refuse(self.context, frame, fit)
