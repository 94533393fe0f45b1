"""A store-and-forward Ethernet switch: full-duplex ports of one rate, a finite queue at each exit.

A train of packets (transmission time T, first packet t) is pipelined: its first packet goes on
while the second comes in, so that a lone train arrives T + t + 2 propagation after its sending.

At the sender's port trains go one after another; a single packet goes between two packets of the
train under way, and before the trains that wait (as fq_codel serves sparse flows, RFC 8290).

At an exit longer trains that come in together are interleaved: the queue is a fluid one. A train
puts its first packet there at once and pours the rest in at line rate; the queue pours out at line
rate, in order of arrival. Fluid and packets differ by less than one packet of each train that is
coming in, hence so do the arrivals, and no more trains come in at once than there are ports.
``per_segment`` sends packet by packet instead, without that error, for an event and more a packet.

What will be in the switch within 0.1 ms, a packet or a train of up to eight, is settled when it is
sent, behind all that was settled before, if no longer train is before it at its exit. What is sent
later but is in earlier does not delay it, so that it may arrive too early: by at most 0.1 ms and a
packet for each other port, the most that can come in from there meanwhile; the latter arrives too
late, by no more. (In maze_30 with ``direct`` not one arrival differs.) For the same reason an
exit's ``busy_ns`` may be ahead by 0.1 ms.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from functools import lru_cache
from heapq import heappop, heappush

from pydantic import Field

from desim import ports
from desim.errors import InputError, did_you_mean
from desim.units import BitRate, ByteSize, Duration, airtime_ns
from netmodels.ethernet import FULL_BYTES, GAP_BYTES, segment_sizes

_AHEAD_NS = 100_000  # what will be in the switch so soon is settled when it is sent

_deliver = lru_cache(1 << 10)(ports.Deliver)  # an idle exit gives the same delays again


class Exit:
    """The queue of one port towards its host, in ns of transmission. Asked in order of time."""

    __slots__ = ("_limit_ns", "_at_ns", "_work_ns", "_idle_ns", "_awaited", "_trains", "_changes",
                 "_full_at_ns")

    def __init__(self, limit_ns: int) -> None:
        self._limit_ns = limit_ns
        self._at_ns = 0  # now, or when the packet will be here that was foreseen last
        self._work_ns = 0  # what waits then
        self._idle_ns = 0  # without work, until then
        self._awaited = 0  # packets that will be asked about when they are here
        self._trains = 0  # coming in
        self._changes: list[tuple[int, int, int]] = []  # of trains, a heap: when, trains, work
        self._full_at_ns = -1

    def foresee(self, first_ns: int, last_ns: int, packet_ns: int) -> int | None:
        """When something will have left that is on its way, a packet or a train of which the first
        packet will be here at ``first_ns`` and the last one at ``last_ns``: after all that was
        foreseen before, even if that is here a little later. None if it cannot be told yet: others
        are awaited, a train will be here before or the queue may be full."""
        if self._awaited or self._trains or (self._changes and self._changes[0][0] <= last_ns):
            return None
        at_ns = self._at_ns
        idle_ns = 0
        if first_ns < at_ns:
            work_ns = self._work_ns + (at_ns if at_ns < last_ns else last_ns) - first_ns
        else:
            work_ns = self._work_ns - (first_ns - at_ns)
            if work_ns < 0:
                work_ns, idle_ns = 0, -work_ns
        if work_ns and work_ns + packet_ns > self._limit_ns:
            return None
        self._idle_ns += idle_ns
        if last_ns > at_ns:
            self._at_ns = at_ns = last_ns
        self._work_ns = work_ns = work_ns + packet_ns
        return at_ns + work_ns

    def wait(self) -> None:
        """A packet will be here."""
        self._awaited += 1

    def packet(self, now_ns: int, wire_ns: int) -> int | None:
        """When an awaited packet that is here now will have left; None if it finds the queue
        full."""
        self._awaited -= 1
        self._run(now_ns)
        work_ns = self._work_ns + wire_ns
        if work_ns > wire_ns and work_ns > self._limit_ns:
            return None
        self._work_ns = work_ns
        return self._at_ns + work_ns

    def announce(self, first_ns: int, last_ns: int, packet_ns: int) -> None:
        """A train's first packet will be here at ``first_ns``, its last one at ``last_ns``."""
        if first_ns < self._at_ns:  # what comes before that is taken to be here then
            self._work_ns += min(self._at_ns, last_ns) - first_ns
        heappush(self._changes, (first_ns, 1, packet_ns))
        heappush(self._changes, (last_ns, -1, 0))

    def train(self, first_ns: int, now_ns: int) -> int | None:
        """When the train whose last packet is here now will have left; None if the queue was full
        while it came in."""
        self._run(now_ns)
        return None if self._full_at_ns >= first_ns else self._at_ns + self._work_ns

    def busy_ns(self, now_ns: int) -> int:
        """For how long it has been sending; a packet that was foreseen is taken to be here."""
        self._run(now_ns)
        return min(self._at_ns - self._idle_ns, now_ns)

    def _run(self, now_ns: int) -> None:
        """What has come in of trains up to now, and gone out."""
        changes = self._changes
        while changes and changes[0][0] <= now_ns:
            time_ns, trains, work_ns = heappop(changes)
            self._pour(time_ns)
            self._trains += trains
            self._work_ns += work_ns
        self._pour(now_ns)

    def _pour(self, until_ns: int) -> None:
        passed_ns = until_ns - self._at_ns
        if passed_ns <= 0:  # a packet was foreseen up to later
            return
        work_ns = self._work_ns + (self._trains - 1) * passed_ns
        if work_ns > self._limit_ns and self._trains > 1:
            work_ns = max(self._work_ns, self._limit_ns)
            self._full_at_ns = until_ns
        if work_ns < 0:
            self._idle_ns -= work_ns
            work_ns = 0
        self._work_ns = work_ns
        self._at_ns = until_ns


# The exits of a frame, each with the receivers behind it.
Exits = tuple[tuple[int, tuple[int, ...]], ...]

# What is on its way into the switch: the frame, its exits, when its first packet is in, and the
# transmission time of a single packet (0 for a train).
Crossing = tuple[ports.Frame, Exits, int, int]


class Switch:
    """Hosts that share a port (virtual machines on one node) share its rate in both directions;
    what they say to each other stays inside the node. A broadcast is copied to the exits of its
    receivers only."""

    __slots__ = ("_params", "_rate_bps", "_propagation_ns", "_local_ns", "_packet_ns", "_full_ns",
                 "_lost", "_context", "_port", "_exits_to", "_trains_free_ns", "_packets_free_ns",
                 "_booked_ns", "_waiting", "_exits")

    class Params(ports.Params):
        rate_bps: BitRate = Field("1 Gb/s", description="of every port (the paper: Gigabit)")
        propagation_ns: Duration = Field("500 ns", description="of one cable (100 m at 2e8 m/s)")
        queue_bytes: ByteSize = Field("4 MB", description="packet buffer of an exit (access "
                                                          "switches have some megabytes)")
        ports: dict[str, list[str]] = Field({}, description="port name to the hosts that share it; "
                                                            "all others have one each (none)")
        local_latency_ns: Duration = Field("0 ns", description="between hosts of one port (the "
                                                               "paper does not say)")
        per_segment: bool = Field(False, description="packet by packet instead of trains (slow)")

    reasons = ("queue_full",)

    def __init__(self, params: Params) -> None:
        self._params = params
        self._rate_bps = params.rate_bps
        self._propagation_ns = params.propagation_ns
        self._local_ns = params.local_latency_ns
        self._packet_ns = lru_cache(1 << 12)(lambda size_bytes: self._wire_ns(size_bytes, 1))
        self._full_ns = self._packet_ns(FULL_BYTES)
        self._lost: set[tuple[int, int]] = set()  # (frame id, exit) of trains that lost a packet

    def start(self, context: ports.Context, hosts: tuple[str, ...]) -> None:
        self._context = context
        self._port = _assign(self._params.ports, hosts)
        self._exits_to = [((port, (host,)),) for host, port in enumerate(self._port)]
        count = max(self._port, default=0) + 1
        self._trains_free_ns = [0] * count
        self._packets_free_ns = [0] * count
        self._booked_ns = [0] * count  # of sending into the switch, up to the later of these
        self._waiting: list[deque[Crossing]] = [deque() for _ in range(count)]  # packets, far off
        limit_ns = airtime_ns(self._params.queue_bytes, self._rate_bps)
        self._exits = [Exit(limit_ns) for _ in range(count)]

    def send(self, frame: ports.Frame) -> int | None:
        _, source, receivers, size_bytes, segments, broadcast = frame
        port = self._port[source]
        exits = self._exits_to[receivers[0]]
        if broadcast:
            exits = self._leave(frame, port)
            if not exits:
                return None
        elif exits[0][0] == port:
            return self._local_ns
        if segments == 1:
            return self._send_packet(frame, port, exits, size_bytes, broadcast)
        if self._params.per_segment:
            return self._send_segments(frame, port, exits)
        return self._send_train(frame, port, exits)

    def busy_ns(self, hosts: Sequence[int]) -> list[int]:
        """``ports.NetworkModel``: for how long there was something on the wire, preambles and gaps
        included, in either direction of each port of ``hosts``."""
        now_ns = self._context.now_ns
        ports_ = sorted({self._port[host] for host in hosts})
        into = [self._booked_ns[port] - max(
            self._trains_free_ns[port] - now_ns, self._packets_free_ns[port] - now_ns, 0)
            for port in ports_]
        return into + [self._exits[port].busy_ns(now_ns) for port in ports_]

    def _leave(self, frame: ports.Frame, port: int) -> Exits:
        """A broadcast's exits other than its own port; who is behind that one has it at once."""
        groups: dict[int, list[int]] = {}
        for receiver in frame.receivers:
            groups.setdefault(self._port[receiver], []).append(receiver)
        if port in groups:
            self._context.settle_many(frame, groups.pop(port), ports.Deliver(self._local_ns))
        return tuple(groups.items())

    def _send_packet(self, frame: ports.Frame, port: int, exits: Exits, size_bytes: int,
                     broadcast: bool) -> int | None:
        now_ns = self._context.now_ns
        wire_ns = self._packet_ns(size_bytes)
        begin_ns = self._packets_free_ns[port]
        if begin_ns < now_ns:
            begin_ns = now_ns
        if self._trains_free_ns[port] > begin_ns:
            begin_ns = min(begin_ns + self._full_ns, self._trains_free_ns[port])
            self._trains_free_ns[port] += wire_ns
        end_ns = self._packets_free_ns[port] = begin_ns + wire_ns
        self._booked_ns[port] += wire_ns
        in_ns = end_ns + self._propagation_ns
        if broadcast:
            self._await(exits)
            self._context.at(in_ns, self._cross, (frame, exits, in_ns, wire_ns))
        elif in_ns - now_ns <= _AHEAD_NS:
            exit_ = self._exits[exits[0][0]]
            out_ns = exit_.foresee(in_ns, in_ns, wire_ns)
            if out_ns is not None:
                return out_ns - now_ns + self._propagation_ns
            exit_.wait()
            self._context.at(in_ns, self._cross, (frame, exits, in_ns, wire_ns))
        else:
            waiting = self._waiting[port]
            waiting.append((frame, exits, in_ns, wire_ns))
            if len(waiting) == 1:
                self._context.at(in_ns, self._cross_waiting, waiting)
        return None

    def _cross_waiting(self, waiting: deque[Crossing]) -> None:
        """The first of the packets that wait at a port is in the switch, others will be soon."""
        now_ns = self._context.now_ns
        while waiting and waiting[0][2] - now_ns <= _AHEAD_NS:
            frame, exits, in_ns, wire_ns = crossing = waiting.popleft()
            out_ns = self._exits[exits[0][0]].foresee(in_ns, in_ns, wire_ns)
            if out_ns is None:
                self._await(exits)
                self._context.at(in_ns, self._cross, crossing)
            else:
                self._context.settle(frame, frame.receivers[0],
                                     _deliver(out_ns - now_ns + self._propagation_ns))
        if waiting:
            self._context.at(waiting[0][2], self._cross_waiting, waiting)

    def _send_train(self, frame: ports.Frame, port: int, exits: Exits) -> int | None:
        begin_ns = self._begin_train(port)
        end_ns = begin_ns + self._wire_ns(frame.size_bytes, frame.segments)
        self._trains_free_ns[port] = end_ns
        self._booked_ns[port] += end_ns - begin_ns
        packet_ns = self._packet_ns(segment_sizes(frame.size_bytes, frame.segments)[0])
        first_ns = begin_ns + packet_ns + self._propagation_ns
        last_ns = end_ns + self._propagation_ns
        now_ns = self._context.now_ns
        if last_ns - now_ns <= _AHEAD_NS and not frame.broadcast:
            out_ns = self._exits[exits[0][0]].foresee(first_ns, last_ns, packet_ns)
            if out_ns is not None:
                return out_ns - now_ns + self._propagation_ns
        for exit_, _ in exits:
            self._exits[exit_].announce(first_ns, last_ns, packet_ns)
        self._context.at(last_ns, self._cross, (frame, exits, first_ns, 0))
        return None

    def _send_segments(self, frame: ports.Frame, port: int, exits: Exits) -> None:
        end_ns = self._begin_train(port)
        first_ns = None
        sizes = segment_sizes(frame.size_bytes, frame.segments)
        for number, size_bytes in enumerate(sizes, 1):
            wire_ns = self._packet_ns(size_bytes)
            end_ns += wire_ns
            self._booked_ns[port] += wire_ns
            in_ns = end_ns + self._propagation_ns
            first_ns = first_ns or in_ns
            self._await(exits)
            self._context.at(in_ns, self._cross if number == len(sizes) else self._cross_segment,
                             (frame, exits, first_ns, wire_ns))
        self._trains_free_ns[port] = end_ns

    def _cross(self, crossing: Crossing) -> None:
        """The last packet is in the switch."""
        context = self._context
        now_ns = context.now_ns
        frame, exits, first_ns, wire_ns = crossing
        for exit_, receivers in exits:
            queue = self._exits[exit_]
            end_ns = queue.packet(now_ns, wire_ns) if wire_ns else queue.train(first_ns, now_ns)
            if end_ns is None or self._lost and (frame.id, exit_) in self._lost:
                self._lost.discard((frame.id, exit_))
                verdict = ports.Drop("queue_full")
            else:
                verdict = _deliver(end_ns - now_ns + self._propagation_ns)
            for receiver in receivers:
                context.settle(frame, receiver, verdict)

    def _cross_segment(self, crossing: Crossing) -> None:
        """A packet of a train, not its last, is in the switch."""
        frame, exits, _, wire_ns = crossing
        for exit_, _ in exits:
            if self._exits[exit_].packet(self._context.now_ns, wire_ns) is None:
                self._lost.add((frame.id, exit_))

    def _await(self, exits: Exits) -> None:
        for exit_, _ in exits:
            self._exits[exit_].wait()

    def _begin_train(self, port: int) -> int:
        return max(self._context.now_ns, self._trains_free_ns[port], self._packets_free_ns[port])

    def _wire_ns(self, size_bytes: int, segments: int) -> int:
        return airtime_ns(size_bytes + segments * GAP_BYTES, self._rate_bps)


def _assign(shared: dict[str, list[str]], hosts: tuple[str, ...]) -> list[int]:
    """Host index to port number. Raises ``InputError`` for unknown hosts and those named twice."""
    port_of: dict[str, int] = {}
    for number, (port, members) in enumerate(shared.items()):
        for host in members:
            if host not in hosts:
                raise InputError(f".ports.{port}: no host {host!r}{did_you_mean(host, hosts)}; "
                                 f"hosts are {', '.join(hosts)}")
            if host in port_of:
                raise InputError(f".ports.{port}: host {host!r} has a port already")
            port_of[host] = number
    return [port_of.setdefault(host, len(shared) + index) for index, host in enumerate(hosts)]
