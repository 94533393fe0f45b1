"""The queue in front of a station's radio, which takes in little at a time."""

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Callable, Sequence
from functools import partial

from desim import ports
from desim.units import airtime_ns
from netmodels.hops import Hops
from netmodels.infrastructure.packet_queue import Dropped, PacketQueue, Receivers, Waiting
from netmodels.infrastructure.trips import Trip
from netmodels.radio.access_categories import rank_of

# What a radio has taken in for a station and not sent yet, as airtime at the medium's rate: with
# less than ``BUSY_NS`` for all, and with more (Linux: IEEE80211_DEFAULT_AQL_TXQ_LIMIT_H, _L and
# IEEE80211_AQL_THRESHOLD of include/net/cfg80211.h; ieee80211_txq_airtime_check).
RADIO_NS, BUSY_RADIO_NS, BUSY_NS = 12_000_000, 5_000_000, 24_000_000
# What an access point keeps for a station that sleeps; the oldest is dropped (Linux:
# STA_MAX_TX_BUFFER of net/mac80211/sta_info.h).
KEPT_PACKETS = 64


class AirHop:
    """The packets of a trip on one hop over the air, to one of ``receivers`` or, as broadcasts,
    to all. Packets go by their number among those that were left of it; ``lost`` has those that did
    not come to a receiver, and why. ``over(hop, leg)`` is called when each has its fate everywhere,
    with the last frame that was sent (None: none was)."""

    def __init__(self, trip: Trip, receivers: tuple[int, ...], broadcast: bool,
                 over: Callable[[AirHop, ports.Frame | None], object]) -> None:
        self.trip, self.receivers, self.broadcast = trip, receivers, broadcast
        self._over = over
        self.sizes = trip.sizes()
        self.lost: dict[int, dict[int, str]] = {receiver: {} for receiver in receivers}
        self._open = len(self.sizes) * len(receivers)

    def settle(self, receivers: Sequence[int], packets: Sequence[int], lost: dict[int, str],
               leg: ports.Frame | None) -> None:
        """These packets have their fate at these receivers: ``lost`` for a reason, or arrived."""
        if lost:
            for receiver in receivers:
                self.lost[receiver] |= lost
        self._open -= len(packets) * len(receivers)
        if not self._open:
            self._over(self, leg)


class _Train:
    """Packets of a hop that the radio takes in together. ``left``: receivers at which they have no
    fate yet."""

    def __init__(self, hop: AirHop) -> None:
        self.hop, self.left = hop, len(hop.receivers)
        self.packets: list[int] = []
        self.size_bytes = self.air_ns = 0

    def add(self, packets: Waiting, air_ns: int) -> None:
        """Let packets go with it."""
        self.packets.extend(range(packets.number, packets.number + packets.packets))
        self.size_bytes += packets.size_bytes
        self.air_ns += air_ns

    def takes(self, hop: AirHop) -> bool:
        """Whether a packet of this hop may follow: broadcasts go one by one."""
        return hop is self.hop and not hop.broadcast


class _Lane:
    """The packets of one access category at a station. ``awake``: what was kept for a station that
    slept, and goes first now."""

    def __init__(self, queue: PacketQueue) -> None:
        self.queue = queue
        self.awake: deque[Waiting] = deque()
        # Trains that the radio has taken in, from the oldest without a fate on: it keeps the places
        # of those behind that one.
        self.inside: deque[_Train] = deque()
        self.packets = 0  # in those
        self.inside_for: Counter[Receivers] = Counter()  # airtime without a fate by station

    def over(self, train: _Train) -> None:
        """A train has its fate everywhere."""
        self.inside_for[train.hop.receivers] -= train.air_ns
        while self.inside and not self.inside[0].left:
            self.packets -= len(self.inside.popleft().packets)


class AirOutlet:
    """The packets that wait at a station for its radio, in a queue for each access category, of
    which that takes in at most three quarters of its queue's ``places``, and consecutive ones of a
    trip as one train. Where stations have queues of their own, the airtime of what it takes in for
    each is limited, but for broadcasts."""

    def __init__(self, station: int, queue: Callable[[], PacketQueue], air: Hops, rate_bps: int,
                 ack_ns: int, places: int) -> None:
        """``ack_ns``: from a frame's arrival until its acknowledgement is there, at most."""
        self._station, self._new_queue, self._air = station, queue, air
        self._rate_bps, self._ack_ns = rate_bps, ack_ns
        self._most = places - places // 4  # packets; the other places are for management frames
        self._lanes: dict[int, _Lane] = {}  # by the rank of their category
        self._inside_ns = 0  # airtime of what the radio has taken in, without a fate
        self._serving = self._booked = False
        self._paused = False
        self._when_empty: Callable[[None], object] | None = None
        self._asleep: dict[int, deque[Waiting]] = {}  # by station: what is kept for it

    def take(self, hop: AirHop) -> None:
        """Let the packets of a hop wait for the radio."""
        now_ns = self._air.now_ns
        lane = self._lane(hop)
        dropped = lane.queue.push(now_ns, Waiting(
            hop, 0, hop.trip.size_bytes(), now_ns, len(hop.sizes)), lane.packets)
        self._serve()
        _lose(dropped)

    def pause(self, then: Callable[[None], object]) -> None:
        """Let the radio take in no more until ``resume``; call ``then`` when it has sent all, and
        has the last acknowledgement."""
        self._paused, self._when_empty = True, then
        self._notify_empty()

    def resume(self) -> None:
        """Go on."""
        self._paused, self._when_empty = False, None
        self._serve()

    def keep(self, dest: int) -> None:
        """Keep packets for a station from now on, which cannot hear them."""
        self._asleep.setdefault(dest, deque())

    def keeps_for(self, dest: int) -> bool:
        """Whether there are packets that are kept for a station."""
        return bool(self._asleep.get(dest))

    def release(self, dest: int) -> None:
        """Let the packets that were kept for a station go."""
        for waiting in self._asleep.pop(dest, ()):
            self._lane(waiting.hop).awake.append(waiting)
        self._serve()

    def flush(self, dest: int | None, reason: str) -> None:
        """Drop what waits or is kept for one station alone (None: all that there is)."""
        gone = [waiting for one in list(self._asleep) if dest in (None, one)
                for waiting in self._asleep.pop(one)]
        for lane in self._lanes.values():
            lane.awake, awake = deque(), lane.awake
            for waiting in awake:
                (gone if waiting.only_for(dest) else lane.awake).append(waiting)
            gone += lane.queue.take_out(dest)
        _lose([(waiting, reason) for waiting in gone])

    def _lane(self, hop: AirHop) -> _Lane:
        rank = rank_of(hop.trip.dscp)
        if rank not in self._lanes:
            self._lanes[rank] = _Lane(self._new_queue())
        return self._lanes[rank]

    def _serve(self) -> None:
        """Let the radio take in what it may."""
        if self._serving:  # a packet that the radio refuses is back at once
            self._serve_soon()
            return
        self._serving = True
        for lane in list(self._lanes.values()):
            self._send_next(lane)
        self._serving = False

    def _serve_soon(self) -> None:
        """Serve once for all that happens in this instant: a radio is done with many packets at
        once."""
        if not self._booked:
            self._booked = True
            self._air.at(self._air.now_ns, self._serve_booked)

    def _serve_booked(self, _: None) -> None:
        self._booked = False
        self._serve()

    def _send_next(self, lane: _Lane) -> None:
        now_ns = self._air.now_ns
        trains: list[_Train] = []
        dropped: list[Dropped] = []
        takes = partial(self._takes, lane)
        while not self._paused and lane.packets < self._most:
            waiting = (lane.awake.popleft() if lane.awake
                       else lane.queue.pop(now_ns, dropped, takes))
            if waiting is None:
                break
            if self._sleeps(waiting.hop):
                kept = self._asleep[waiting.hop.receivers[0]]
                kept.extend(waiting.singly())
                while len(kept) > KEPT_PACKETS:
                    dropped.append((kept.popleft(), "queue_full"))
                continue
            for packets in waiting.singly() if waiting.hop.broadcast else (waiting,):
                if not trains or not trains[-1].takes(packets.hop):
                    trains.append(_Train(packets.hop))
                air_ns = self._air_ns(packets)
                trains[-1].add(packets, air_ns)
                lane.packets += packets.packets
                self._inside_ns += air_ns
                lane.inside_for[packets.hop.receivers] += air_ns
        lane.inside.extend(trains)
        for train in trains:
            hop = train.hop
            self._air.send(self._station, hop.receivers, train.size_bytes, len(train.packets),
                           hop.broadcast, partial(self._sent, lane, train), hop.trip.frame.id,
                           hop.trip.dscp)
        _lose(dropped)

    def _air_ns(self, packets: Waiting) -> int:
        """The airtime of packets, of which none is longer than the one before."""
        sizes, last = packets.hop.sizes, packets.number + packets.packets - 1
        if sizes[packets.number] == sizes[last]:
            return packets.packets * airtime_ns(sizes[last], self._rate_bps)
        return sum(airtime_ns(size, self._rate_bps) for size in sizes[packets.number:last + 1])

    def _takes(self, lane: _Lane, receivers: Receivers | None, size_bytes: int) -> int:
        """The number of packets of so many bytes that the radio takes in for a station."""
        places = self._most - lane.packets
        if receivers is None or len(receivers) > 1:
            return places
        own_ns = lane.inside_for[receivers]
        free_ns = max(BUSY_RADIO_NS - own_ns, min(BUSY_NS - self._inside_ns, RADIO_NS - own_ns))
        if free_ns <= 0:
            return 0
        if not size_bytes:
            return places
        return min(places, -(-free_ns // airtime_ns(size_bytes, self._rate_bps)))

    def _sent(self, lane: _Lane, train: _Train, leg: ports.Frame, receivers: Sequence[int],
              verdict: ports.Deliver | ports.Drop, lost: dict[int, str]) -> None:
        packets = train.packets
        gone = {packets[number]: reason for number, reason in lost.items()}
        if isinstance(verdict, ports.Drop):
            gone = dict.fromkeys(packets, verdict.reason) | gone
        train.left -= len(receivers)
        if not train.left:
            self._inside_ns -= train.air_ns
            lane.over(train)
            self._serve_soon()
        hop = train.hop
        if gone and self._sleeps(hop):  # it could not hear them: they wait for it as the others
            self._asleep[receivers[0]].extendleft(
                Waiting(hop, number, hop.sizes[number], self._air.now_ns)
                for number in sorted(gone, reverse=True))
            packets = [number for number in packets if number not in gone]
            gone = {}
        hop.settle(receivers, packets, gone, leg)
        self._notify_empty()

    def _sleeps(self, hop: AirHop) -> bool:
        """Whether a hop goes to a station that sleeps."""
        return not hop.broadcast and hop.receivers[0] in self._asleep

    def _notify_empty(self) -> None:
        if not self._inside_ns and self._when_empty is not None:
            then, self._when_empty = self._when_empty, None
            self._air.at(self._air.now_ns + self._ack_ns, then)


def _lose(dropped: Sequence[Dropped]) -> None:
    for waiting, reason in dropped:
        packets = range(waiting.number, waiting.number + waiting.packets)
        waiting.hop.settle(waiting.hop.receivers, packets, dict.fromkeys(packets, reason), None)
