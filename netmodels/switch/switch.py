"""The model of a store-and-forward Ethernet switch."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache, partial
from typing import Literal

import numpy as np
from pydantic import Field

from desim import ports
from desim.errors import InputError, did_you_mean
from desim.units import BitRate, ByteSize, Duration, airtime_ns
from netmodels.ethernet import GAP_BYTES
from netmodels.switch.compiled_queues import CompiledQueues
from netmodels.switch.kernels.records import NEVER
from netmodels.switch.times import Copy, SwitchTimes
from netmodels.switch.trains import cut

# A frame that will be in the switch so soon is settled when it is sent: the time of 35 scans of the
# paper's laser on one line. Its error: docs/network-models.md.
_AHEAD_NS = 250_000

_new = tuple.__new__  # a Frame at half the price
_deliver = lru_cache(1 << 10)(ports.Deliver)  # an idle exit gives the same delays again


class Switch:
    """Full-duplex ports of one rate. Hosts that share a port (virtual machines on one node) share
    its rate in both directions; frames between them stay inside the node. A broadcast is
    copied to the exits of its receivers only.

    Two queues are in a packet's way. The interface of its sender serves the flows of its port in
    turn (``fq_codel``: deficit round robin by packets, flows that have just begun first) or all in
    order (``pfifo``). Packets that wait there stay in the sockets and are never lost. Left out:
    CoDel's drops and the packet limits; Linux's TCP small queues keep both away from streams. The
    switch's exit serves packets in order of arrival, and drops those for which it has no room.

    Capabilities: CountsBusyTime, NamesChannels, Itemizes, SendsMany.
    """

    class Params(ports.Params):
        rate_bps: BitRate = Field("1 Gb/s", description="of every port (the paper: Gigabit)")
        propagation_ns: Duration = Field("500 ns", description="of one cable (100 m at 2e8 m/s)")
        queue: Literal["pfifo", "fq_codel"] = Field("fq_codel", description=(
            "of a sender's interface: flows in turn, or all in order. (Linux distributions since "
            "2015, net.core.default_qdisc; in testbed pfifo: pfifo_fast of the paper's time)"))
        buffer_bytes: ByteSize = Field("4 MB", description="of an exit, for packets (access "
                                                           "switches have some megabytes)")
        ports: dict[str, tuple[str, ...]] = Field({}, description=(
            "port name to the hosts that share it; all others have one each (none)"))
        local_latency_ns: Duration = Field("0 ns", description="between hosts of one port (the "
                                                               "paper does not say)")

        def check_hosts(self, hosts: tuple[str, ...]) -> None:
            """``ports.ChecksHosts``."""
            _assign(self.ports, hosts)

    reasons = ("queue_full",)

    def __init__(self, params: Params) -> None:
        rate_bps = params.rate_bps
        self._params = params
        self._fair = params.queue == "fq_codel"
        self._local_ns = params.local_latency_ns
        self._hop_ns = params.propagation_ns - airtime_ns(GAP_BYTES, rate_bps)
        self._limit_ns = airtime_ns(params.buffer_bytes, rate_bps)
        self._ahead_ns = _AHEAD_NS
        self._cut = lru_cache(1 << 12)(partial(cut, rate_bps=rate_bps))
        self._times: SwitchTimes | None = None  # where a ledger is kept

    def itemize(self, ledger: ports.Ledger) -> None:
        self._times = SwitchTimes(ledger, self._params.propagation_ns, self._hop_ns, self._cut)

    def start(self, context: ports.Context, hosts: tuple[str, ...]) -> None:
        self._context = context
        self._port = _assign(self._params.ports, hosts)
        self._names = {**dict(zip(self._port, hosts, strict=True)),
                       **dict(enumerate(self._params.ports))}
        count = max(self._port, default=0) + 1
        self._queues: CompiledQueues[Copy] = CompiledQueues(
            count, self._hop_ns, self._limit_ns, self._fair, self._ahead_ns, self._local_ns)
        self._due_ns = NEVER
        self._timer: ports.Handle | None = None
        # The exits of a batch; a fleet's sensors always have the same receivers.
        self._exits = lru_cache(1 << 5)(lambda receivers: np.array(
            [self._port[receiver] for receiver in receivers]))

    def send(self, frame: ports.Frame) -> int | None:
        _, source, receivers, size_bytes, segments, broadcast = frame
        port = self._port[source]
        if broadcast:
            exit_, copies = -1, self._leave(frame, port)
            if not copies:
                return None
        else:
            exit_ = self._port[receivers[0]]
            if exit_ == port:
                if self._times is not None:
                    self._times.local(frame, self._local_ns)
                return self._local_ns
            copies = [(exit_, (frame, receivers))]
        queues, cut = self._queues, self._cut
        train, now_ns, book = cut(size_bytes, segments), self._context.now_ns, queues.send
        delay_ns = book(queues.rows, now_ns, port, exit_, train)
        if delay_ns < 0:
            queues.put(now_ns, port, self._context.flow(frame) if self._fair else None, train,
                       copies, not broadcast)
            if queues.due_ns < self._due_ns:
                self._book(queues.due_ns)
        if self._times is not None:
            self._times.sent(frame, sum(len(there) for _, (_, there) in copies), now_ns)
            if delay_ns >= 0:
                self._times.passed(frame, receivers, (), queues.left_ns(port), now_ns + delay_ns)
        return None if delay_ns < 0 else delay_ns

    def send_many(self, frames: ports.Frames) -> Sequence[int | None]:
        number, source, receivers, size_bytes, segments = frames
        queues = self._queues

        def copies(places: Sequence[int]) -> list[Copy]:
            return [(_new(ports.Frame, (number + i, source, receivers[i:i + 1], size_bytes,
                                        segments, False)), receivers[i:i + 1]) for i in places]

        delays = queues.send_many(
            self._context.now_ns, self._port[source], self._exits(receivers),
            self._cut(size_bytes, segments), copies)
        if queues.due_ns < self._due_ns:
            self._book(queues.due_ns)
        return delays

    def busy_ns(self, hosts: Sequence[int]) -> list[int]:
        """For how long there was something on the wire, preambles and gaps included, in either
        direction of each port of ``hosts``."""
        return self._queues.busy_ns(self._context.now_ns, self._ports_of(hosts))

    def channels(self, hosts: Sequence[int]) -> list[str]:
        """The directions of the ports of ``hosts``: first sending of all, then receiving."""
        names = [self._names[port] for port in self._ports_of(hosts)]
        return [*(f"{name} sending" for name in names), *(f"{name} receiving" for name in names)]

    def _ports_of(self, hosts: Sequence[int]) -> list[int]:
        return sorted({self._port[host] for host in hosts})

    def _leave(self, frame: ports.Frame, port: int) -> list[tuple[int, Copy]]:
        """A broadcast's exits other than its own port; it arrives at the hosts of that one at
        once."""
        groups: dict[int, list[int]] = {}
        for receiver in frame.receivers:
            groups.setdefault(self._port[receiver], []).append(receiver)
        if port in groups:
            if self._times is not None:
                self._times.local(frame, self._local_ns, groups[port])
            self._context.settle_many(frame, groups.pop(port), ports.Deliver(self._local_ns))
        return [(exit_, (frame, receivers)) for exit_, receivers in groups.items()]

    def _book(self, due_ns: int) -> None:
        """Have ``_wake`` called at ``due_ns``, which is earlier than it would be."""
        if self._timer is not None:
            self._timer.cancel()
        self._due_ns = due_ns
        self._timer = self._context.at(due_ns, self._wake)

    def _wake(self, _: None) -> None:
        """Settle the frames that are in the switch by now, or will be soon."""
        context, queues = self._context, self._queues
        fates = queues.wake(context.now_ns)
        self._due_ns = queues.due_ns
        self._timer = None if self._due_ns == NEVER else context.at(self._due_ns, self._wake)
        if self._times is not None:
            self._times.woken(context.now_ns, fates, queues.departures_ns(len(fates)))
        for (frame, receivers), delay_ns, lost in fates:
            if lost:
                whole = len(lost) == frame.segments
                context.settle_many(frame, receivers, ports.Drop(
                    "queue_full", None if whole else tuple(lost)))
                if whole:
                    continue
            if frame.broadcast:
                context.settle_many(frame, receivers, ports.Deliver(delay_ns))
            else:
                context.settle(frame, receivers[0], _deliver(delay_ns))


def _assign(shared: dict[str, tuple[str, ...]], hosts: tuple[str, ...]) -> list[int]:
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
