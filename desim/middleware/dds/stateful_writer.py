"""The stateful writer of RTPS (8.4.7.4): reliable, with a proxy for each reader."""

from __future__ import annotations

from typing import TYPE_CHECKING

from desim.middleware.dds.blocked_calls import HeldCall
from desim.middleware.dds.heartbeat_piggyback import Always, WhenFull
from desim.middleware.dds.reader_proxy import ReaderProxy
from desim.middleware.dds.writer_proxy import DIRECTED
from desim.middleware.transports import LinkedTransport

if TYPE_CHECKING:
    from desim.middleware.dds.dds import Dds
    from desim.middleware.message import Message
    from desim.ports.middleware import Advertisement


class StatefulWriter(LinkedTransport[ReaderProxy]):
    """One writer, with a proxy for each host whose reader it has matched. It keeps ``depth``
    samples; 0: all that are not acknowledged, as many as its resources allow. Then a call waits for
    room."""

    def __init__(self, dds: Dds, advertised: Advertisement) -> None:
        super().__init__(self._proxy_of, dds.context.drop)
        self._dds, self._advertised = dds, advertised
        self._host, self._topic = advertised.publisher.host, advertised.publisher.topic
        params, constants = dds.params, dds.constants
        self.depth = advertised.queue if params.depth is None else params.depth
        # KEEP_ALL: the samples that may wait for acknowledgements, or their bytes; 0: any number.
        self._most_samples = 0 if self.depth else constants.max_samples or 0
        self._high_bytes = 0 if self.depth else constants.high_bytes or 0
        self._limited = bool(self._most_samples or self._high_bytes)
        self.calls = dds.calls(self._host, advertised.publisher.node)
        self._written = 0
        self.piggyback: Always | WhenFull = Always()
        if constants.heartbeat_rides != "always":
            full = self._many_written if constants.heartbeat_rides == "written" else self._many_wait
            self.piggyback = WhenFull(full, constants.heartbeat_after_bytes or 1 << 62,
                                      dds.participants[self._host])
        self._connected = False  # its publisher has connected it
        self._fresh: list[int] = []
        self._closed: list[ReaderProxy] = []  # with frames that are still on their way

    def connect(self, receivers: list[int]) -> list[int]:
        self._connected = True
        self._lead_to(receivers)
        fresh, self._fresh = self._fresh, []
        return [receiver for receiver in fresh if receiver in self._links]

    def matches(self) -> None:
        """Send heartbeats to the readers that the writer matches before anything is published."""
        if not self._connected:
            ends = self._dds.subscribers(self._advertised.publisher)
            self._lead_to([end.host for end in ends if end.host != self._host])

    def _lead_to(self, receivers: list[int]) -> None:
        """Connect to the readers on ``receivers``; new ones get a heartbeat a little later."""
        context, old = self._dds.context, self._links
        new = super().connect(receivers)
        proxies = self._links
        self._fresh += new
        self._closed = [proxy for proxy in (*self._closed, *(
            proxy for receiver, proxy in old.items() if proxies.get(receiver) is not proxy))
            if proxy.waiting]
        if self.calls.waiting:
            self.calls.go_on()
        if new:
            context.at(context.now_ns + self._dds.constants.initial_heartbeat_ns, self._host,
                       self._send_first_heartbeats,
                       {receiver: proxies[receiver] for receiver in new})

    def _proxy_of(self, receiver: int, proxy: ReaderProxy | None) -> ReaderProxy | None:
        """The proxy to the reader on ``receiver``. A new participant, as after a host's restart,
        gets a new proxy."""
        dds = self._dds
        medium = dds.context.route(self._host, receiver, self._topic)
        if medium is None:
            return None
        guid = dds.reader(self._host, receiver, self._topic)
        if proxy is None or proxy.guid != guid:
            return ReaderProxy(dds, self._advertised, self, receiver, guid, medium)
        return proxy

    def _send_first_heartbeats(self, new: dict[int, ReaderProxy]) -> None:
        """Send the first heartbeat to readers that are new."""
        dds, proxies = self._dds, self._links
        now = {receiver: (proxy, *proxy.first_heartbeat()) for receiver, proxy in new.items()
               if proxies.get(receiver) is proxy}
        if not now:
            return
        to, size, multicast = list(now), dds.heartbeat_size, False
        if dds.constants.first_heartbeat_to_all and len(proxies) > 1:
            to, size = list(proxies), dds.wire.heartbeat_to_all()
            multicast = dds.params.allow_multicast == "all"
        dds.context.send("heartbeat", self._host, to, size.size_bytes, self._first_heartbeat, now,
                         multicast=multicast,  # other readers ignore it
                         in_advance=lambda receiver: None if receiver in now else lambda *_: None)

    def _first_heartbeat(self, now: dict[int, tuple[ReaderProxy, int, int]], receiver: int) -> None:
        if receiver in now:
            proxy, first, last = now[receiver]
            proxy.writer_proxy.heartbeat(first, last, DIRECTED)

    def send(self, message: Message, only: list[int] | None = None) -> None:
        if only is None and self._links and (
                self.calls.waiting or self._limited and not self.has_room()):
            self.calls.hold(HeldCall(self, message, [*self._links]))
        else:
            proxies = self._links
            to = proxies.values() if only is None else [proxies[receiver] for receiver in only]
            if to:
                beats = self.piggyback.new(self._dds.message_sizes(message.size_bytes))
                self._written += only is None
                for proxy in to:
                    proxy.offer(message, beats)
        if only is None:
            for receiver in self._unrouted:
                self._drop(message, receiver, "no_route")

    # Calls that wait.

    def has_room(self, waited: bool = False) -> bool:
        """Whether the history takes one more sample; of a limit of bytes, for a call that has
        ``waited`` only below the lower mark."""
        if self._most_samples:
            return max((proxy.unacknowledged() for proxy in self._links.values()),
                       default=0) < self._most_samples
        if self._high_bytes:
            most = self._dds.constants.low_bytes if waited else self._high_bytes
            return all(proxy.unacknowledged_bytes() <= most for proxy in self._links.values())
        return True

    def write(self, message: Message, receivers: list[int], since_ns: int) -> None:
        """Send a message that has waited since then to those of ``receivers`` that are still
        matched."""
        self._written += 1
        self._dds.context.waited(since_ns)
        self.send(message, [receiver for receiver in receivers if receiver in self._links])
        for receiver in receivers:
            if receiver not in self._links:
                self._drop(message, receiver, "link_closed")

    def acknowledgements_ns(self) -> list[int]:
        """The instants at which acknowledgements will arrive, as far as that is known."""
        return [due_ns for proxy in self._links.values() for due_ns, _ in proxy.coming]

    def close(self, reason: str) -> None:
        self.calls.drop(self, reason)
        super().close(reason)

    # Whether its history is full, with ``coming`` samples more.

    def _many_written(self, coming: int) -> bool:
        """It keeps acknowledged samples, too."""
        return 0 < (self.depth or self._most_samples) <= self._written + coming

    def _many_wait(self, coming: int) -> bool:
        waiting = max((proxy.unacknowledged() for proxy in self._links.values()), default=0)
        return 0 < (self.depth or self._most_samples) <= waiting + coming

    def waiting(self) -> int:
        return (super().waiting() + sum(proxy.waiting for proxy in self._closed)
                + self.calls.held(self))
