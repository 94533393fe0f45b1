"""The model of a store-and-forward Ethernet switch."""

from __future__ import annotations

from collections import deque
from collections.abc import Hashable, Sequence
from functools import lru_cache
from typing import Literal, cast

from pydantic import Field

from desim import ports
from desim.errors import InputError, did_you_mean
from desim.units import BitRate, ByteSize, Duration, airtime_ns
from netmodels.ethernet import GAP_BYTES
from netmodels.switch.compiled_queues import CompiledQueues
from netmodels.switch.reference_queues import ExitFate, Load, ReferenceQueues
from netmodels.switch.trains import PacketTrain, cut

# A frame that will be in the switch so soon is settled when it is sent. Tuned on eight hosts at
# full load: the mean delay is 1.3e-4 off, and +-20 % changes it by 1.3e-5 at most.
_AHEAD_NS = 100_000

_deliver = lru_cache(1 << 10)(ports.Deliver)  # an idle exit gives the same delays again

# The exits of a frame, each with the receivers behind it.
Exits = tuple[tuple[int, Sequence[int]], ...]

Token = tuple[ports.Frame, int, Exits]  # of a frame in the packet queues: its port and exits

# A frame that is not sent yet, its exits, when the line is free for it if nothing else is put
# before it, and its packets.
Waiting = tuple[ports.Frame, Exits, int, PacketTrain]


class Switch:
    """Full-duplex ports of one rate. Hosts that share a port (virtual machines on one node) share
    its rate in both directions; frames between them stay inside the node. A broadcast is
    copied to the exits of its receivers only.

    Two queues are in a packet's way. The interface of its sender serves the flows of its port in
    turn (``fq_codel``: deficit round robin by packets, flows that have just begun first) or all in
    order (``pfifo``). Packets that wait there stay in the sockets and are never lost. Left out:
    CoDel's drops and the packet limits; Linux's TCP small queues keep both away from streams. The
    switch's exit serves packets in order of arrival, and drops those for which it has no room.

    Frames that meet no other frame skip the packet queues (``_is_alone``, ``_foresee``); ``_join``
    moves one back into the queues when another frame turns up.

    Capabilities: CountsBusyTime, SendsMany.
    """

    class Params(ports.Params):
        rate_bps: BitRate = Field("1 Gb/s", description="of every port (the paper: Gigabit)")
        propagation_ns: Duration = Field("500 ns", description="of one cable (100 m at 2e8 m/s)")
        queue: Literal["pfifo", "fq_codel"] = Field("fq_codel", description=(
            "of a sender's interface: flows in turn, or all in order. (Linux distributions since "
            "2015, net.core.default_qdisc; in testbed pfifo: pfifo_fast of the paper's time)"))
        buffer_bytes: ByteSize = Field("4 MB", description="of an exit, for packets (access "
                                                           "switches have some megabytes)")
        ports: dict[str, list[str]] = Field({}, description="port name to the hosts that share it; "
                                                            "all others have one each (none)")
        local_latency_ns: Duration = Field("0 ns", description="between hosts of one port (the "
                                                               "paper does not say)")
        per_segment: bool = Field(False, description="an event for each packet (slow)")

    reasons = ("queue_full",)

    def __init__(self, params: Params) -> None:
        rate_bps = params.rate_bps
        self._params = params
        self._fair = params.queue == "fq_codel"
        self._local_ns = params.local_latency_ns
        self._hop_ns = params.propagation_ns - airtime_ns(GAP_BYTES, rate_bps)
        self._limit_ns = airtime_ns(params.buffer_bytes, rate_bps)
        self._ahead_ns = -1 if params.per_segment else _AHEAD_NS

        # Its two times beside the train: of a NamedTuple each costs 200 instructions.
        @lru_cache(1 << 12)
        def cut_(size_bytes: int, segments: int) -> tuple[PacketTrain, int, int]:
            train = cut(size_bytes, segments, rate_bps)
            return train, train.total_ns, train.long_ns

        self._cut = cut_

    def start(self, context: ports.Context, hosts: tuple[str, ...]) -> None:
        self._context = context
        self._port = _assign(self._params.ports, hosts)
        self._exits_to: list[Exits] = [((port, (host,)),) for host, port in enumerate(self._port)]
        count = max(self._port, default=0) + 1
        # Of each port, into the switch:
        self._free_ns = [0] * count  # when all will be sent
        self._booked_ns = [0] * count  # how long that takes
        self._queued = [0] * count  # frames that are not sent yet
        self._inside = [0] * count  # those of them that the packet queues know
        self._lines: list[deque[Waiting]] = [deque() for _ in range(count)]  # the others
        self._due_ns = [0] * count  # the next call
        self._timers: list[ports.Handle | None] = [None] * count
        self._loads: list[Load] = [(0, 0, 0)] * count  # of exits that nothing in the queues is for
        self._coming = [0] * count  # frames in the queues that are for this exit
        # A frame that is the only one in its port's line and the only one for its exit, with its
        # flow; and the port of such a frame, by exit. The queues need not know of it: maze_30's
        # first 30 s take 1.75 instead of 1.95 s of CPU (medians of four), with the same digest.
        self._alone: list[tuple[Waiting, Hashable] | None] = [None] * count
        self._alone_for: list[int | None] = [None] * count
        self._engine: ReferenceQueues[Token] | CompiledQueues[Token] = CompiledQueues(
            count, self._hop_ns, self._limit_ns)
        if self._params.per_segment:
            self._engine = ReferenceQueues(count, self._hop_ns, self._limit_ns)

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
        train, total_ns, first_ns = self._cut(size_bytes, segments)
        now_ns = self._context.now_ns
        begin_ns = self._free_ns[port]
        if begin_ns < now_ns:
            begin_ns = now_ns
        self._free_ns[port] = end_ns = begin_ns + total_ns
        self._booked_ns[port] += total_ns
        if end_ns - now_ns <= self._ahead_ns and not (broadcast or self._queued[port]):
            out_ns = self._foresee(exits[0][0], begin_ns, total_ns, first_ns)
            if out_ns is not None:
                return out_ns - now_ns
        self._wait((frame, exits, begin_ns, train), port)
        return None

    def send_many(self, frames: ports.Frames) -> list[int]:
        _, source, receivers, size_bytes, segments = frames
        port, exits_to = self._port[source], self._exits_to
        delays: list[int] = []
        if self._queued[port]:
            return delays
        _, total_ns, first_ns = self._cut(size_bytes, segments)
        now_ns = self._context.now_ns
        end_ns = max(self._free_ns[port], now_ns)
        latest_ns = now_ns + self._ahead_ns
        for receiver in receivers:
            exit_ = exits_to[receiver][0][0]
            begin_ns, end_ns = end_ns, end_ns + total_ns
            out_ns = (None if exit_ == port or end_ns > latest_ns
                      else self._foresee(exit_, begin_ns, total_ns, first_ns))
            if out_ns is None:
                end_ns = begin_ns
                break
            delays.append(out_ns - now_ns)
        self._free_ns[port] = end_ns
        self._booked_ns[port] += len(delays) * total_ns
        return delays

    def busy_ns(self, hosts: Sequence[int]) -> list[int]:
        """For how long there was something on the wire, preambles and gaps included, in either
        direction of each port of ``hosts``."""
        now_ns = self._context.now_ns
        for port in range(len(self._alone)):
            self._join(port)
        self._engine.run(now_ns)
        ports_ = sorted({self._port[host] for host in hosts})
        into = [self._booked_ns[port] - max(self._free_ns[port] - now_ns, 0) for port in ports_]
        return into + [self._sent_ns(port, now_ns) for port in ports_]

    def _sent_ns(self, exit_: int, now_ns: int) -> int:
        """For how long an exit has been sending; a foreseen packet counts as if it were here."""
        free_ns, booked_ns, last_ns = (
            self._engine.loaded(exit_) if self._coming[exit_] else self._loads[exit_])
        return min(booked_ns - max(free_ns - max(last_ns, now_ns), 0), now_ns)

    def _leave(self, frame: ports.Frame, port: int) -> Exits:
        """A broadcast's exits other than its own port; it arrives at the hosts of that one at
        once."""
        groups: dict[int, list[int]] = {}
        for receiver in frame.receivers:
            groups.setdefault(self._port[receiver], []).append(receiver)
        if port in groups:
            self._context.settle_many(frame, groups.pop(port), ports.Deliver(self._local_ns))
        return tuple(groups.items())

    def _foresee(self, exit_: int, begin_ns: int, total_ns: int, first_ns: int) -> int | None:
        """Shortcut: the arrival of a frame that will be in the switch within ``_AHEAD_NS``, as if
        it joined its exit's queue now, behind all frames foreseen before. None while the packet
        queues hold a frame for that exit, or if the exit may not have room."""
        if self._coming[exit_]:
            return None
        free_ns, booked_ns, last_ns = self._loads[exit_]
        at_ns = begin_ns + first_ns + self._hop_ns
        if free_ns <= at_ns:
            free_ns = at_ns
        elif free_ns - at_ns + first_ns > self._limit_ns:
            return None
        free_ns += total_ns
        at_ns += total_ns - first_ns
        if at_ns < last_ns:  # max() takes twelve times as long
            at_ns = last_ns
        self._loads[exit_] = free_ns, booked_ns + total_ns, at_ns
        return free_ns + self._hop_ns

    def _wait(self, waiting: Waiting, port: int) -> None:
        """Queue a frame at its port's interface."""
        self._queued[port] += 1
        if self._fair:
            self._join(port)
            self._engine.run(self._context.now_ns)
            self._put(waiting, port, self._context.flow(waiting[0]))
        elif self._inside[port]:
            self._lines[port].append(waiting)
        else:
            self._put(waiting, port, None)

    def _put(self, waiting: Waiting, port: int, flow: Hashable) -> None:
        """Hand a frame to the packet queues, unless nothing else competes with it."""
        frame, exits, begin_ns, train = waiting
        self._inside[port] += 1
        if self._inside[port] == 1 and self._is_alone(exits, begin_ns, train):
            self._alone[port] = waiting, flow
            self._alone_for[exits[0][0]] = port
            self._coming[exits[0][0]] = 1
            self._book_wake(port, begin_ns + train.total_ns)
            return
        self._enter(exits)
        self._engine.put(port, begin_ns, flow, train, [exit_ for exit_, _ in exits],
                         (frame, port, exits))
        if (self._timers[port] is None
                or self._context.now_ns + train.total_ns < self._due_ns[port]):
            self._book_wake(port, self._engine.due_ns(port))

    def _enter(self, exits: Exits) -> None:
        """Count a frame as coming to ``exits``; the packet queues take over idle ones."""
        coming = self._coming
        for exit_, _ in exits:
            alone_port = self._alone_for[exit_]
            if alone_port is not None:
                self._join(alone_port)
            elif not coming[exit_]:
                self._engine.load(exit_, self._loads[exit_])
            coming[exit_] += 1

    def _is_alone(self, exits: Exits, begin_ns: int, train: PacketTrain) -> bool:
        """Whether no other frame is for this frame's one exit, and the exit has room."""
        exit_ = exits[0][0]
        if self._params.per_segment or len(exits) > 1 or self._coming[exit_]:
            return False
        wait_ns = self._loads[exit_][0] - (begin_ns + train.long_ns + self._hop_ns)
        return wait_ns <= 0 or wait_ns + train.long_ns <= self._limit_ns

    def _join(self, port: int) -> None:
        """Move a port's lone frame, if it has one, back into the packet queues: another frame has
        turned up."""
        alone = self._alone[port]
        if alone is None:
            return
        (frame, exits, begin_ns, train), flow = alone
        exit_ = exits[0][0]
        self._alone[port] = self._alone_for[exit_] = None
        self._engine.load(exit_, self._loads[exit_])
        self._engine.put(port, begin_ns, flow, train, [exit_], (frame, port, exits))

    def _book_wake(self, port: int, due_ns: int) -> None:
        timer = self._timers[port]
        if timer is not None:
            timer.cancel()
        self._due_ns[port] = due_ns
        self._timers[port] = self._context.at(due_ns, self._wake, port)

    def _wake(self, port: int) -> None:
        """Settle the frames that are in the switch by now."""
        self._timers[port] = None
        alone = self._alone[port]
        if alone is not None:
            self._arrive_alone(port, alone[0])
            return
        engine, loads, coming = self._engine, self._loads, self._coming
        engine.run(self._context.now_ns)
        finished = engine.finished()
        for (_, from_, exits), _ in finished:
            self._queued[from_] -= 1
            self._inside[from_] -= 1
            for exit_, _ in exits:
                coming[exit_] -= 1
                if not coming[exit_]:
                    loads[exit_] = engine.loaded(exit_)
        if self._inside[port]:
            self._book_wake(port, engine.due_ns(port))
        elif self._queued[port]:
            self._go_on(port)
        for (frame, _, exits), outcomes in finished:
            for (_, receivers), outcome in zip(exits, outcomes, strict=True):
                self._settle(frame, receivers, outcome)

    def _arrive_alone(self, port: int, waiting: Waiting) -> None:
        """The lone frame of a port is in the switch: settle it."""
        frame, exits, begin_ns, train = waiting
        exit_ = exits[0][0]
        self._alone[port] = self._alone_for[exit_] = None
        self._coming[exit_] = self._inside[port] = 0
        self._queued[port] -= 1
        # A lone frame's exit has room (``_is_alone``), and no other frame is for it.
        out_ns = cast(int, self._foresee(exit_, begin_ns, train.total_ns, train.long_ns))
        if self._queued[port]:
            self._go_on(port)
        self._context.settle_many(frame, exits[0][1], _deliver(out_ns - self._context.now_ns))

    def _go_on(self, port: int) -> None:
        """Settle frames that will be in the switch soon, and queue the next one on the free
        line."""
        line, context = self._lines[port], self._context
        while line and not self._inside[port]:
            frame, exits, begin_ns, train = waiting = line.popleft()
            out_ns = None
            if begin_ns + train.total_ns - context.now_ns <= self._ahead_ns \
                    and not frame.broadcast:
                out_ns = self._foresee(exits[0][0], begin_ns, train.total_ns, train.long_ns)
            if out_ns is None:
                self._put(waiting, port, None)
            else:
                self._queued[port] -= 1
                context.settle(frame, frame.receivers[0], _deliver(out_ns - context.now_ns))

    def _settle(self, frame: ports.Frame, receivers: Sequence[int], outcome: ExitFate) -> None:
        """The last packet has left the interface. Report lost packets; the rest arrives when the
        last surviving packet is out."""
        context, (out_ns, lost) = self._context, outcome
        if len(lost) == frame.segments:
            context.settle_many(frame, receivers, ports.Drop("queue_full"))
            return
        if lost:
            context.settle_many(frame, receivers, ports.Drop("queue_full", lost))
        verdict = _deliver(max(out_ns - context.now_ns + self._hop_ns, 0))
        context.settle_many(frame, receivers, verdict)


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
