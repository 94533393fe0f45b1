"""A ROS-like process on a host: it subscribes, publishes and sets timers, and holds no clock."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from fractions import Fraction
from operator import attrgetter
from typing import TYPE_CHECKING

import numpy as np

from desim.engine.agenda import Ticker
from desim.errors import InputError
from desim.middleware.contents import Content
from desim.middleware.message import Message
from desim.middleware.topics import PolledSubscription, Publisher, Subscription, WaitSet
from desim.ports.networks import Handle
from desim.units import NS_PER_S

if TYPE_CHECKING:
    from desim.middleware.host import Host


class Node:
    """Subclasses call ``super().__init__(host, name)``; in ``start`` they advertise, subscribe and
    set timers. Nothing of a stopped node runs any more.

    A node is in the ``namespace`` of its host, or of another one for which it works, as with ``ns``
    in a launch file: ``scan`` is ``/robot_3/scan`` in ``robot_3``, wherever the node runs. Its
    random numbers and its trace rows are of the namespace, too. ``name`` is unique on the host.
    ``worked(**quantities)`` adds to the work of the present callback, by the names of
    ``ports.computers.QUANTITIES``: where computers get busy, its time depends on that.
    """

    __slots__ = ("host", "namespace", "name", "worked", "_named", "_id", "_graph", "_publishers",
                 "_tickers", "_alive", "_subscriptions", "_held")

    def __init__(self, host: Host, name: str, namespace: str | None = None) -> None:
        self.host = host
        self.namespace = namespace or host.name
        self.name = name if self.namespace == host.name else f"{namespace}/{name}"
        self._named = "host", self.namespace, name  # of its random numbers
        self.worked = host.worked
        self._graph = host.graph
        self._id = host.graph.names.id(self.namespace)
        self._publishers: dict[str, Publisher] = {}
        self._tickers: list[Handle] = []
        self._subscriptions: list[Subscription] = []
        self._alive = True
        self._held: list[tuple[Callable[..., object], object]] | None = None  # see ``block``

    def start(self) -> None:
        """Called once, when its host starts."""

    def stop(self) -> None:
        """Called by the host when it stops."""
        self._alive, self._held = False, None
        for ticker in self._tickers:
            ticker.cancel()

    def block(self) -> None:
        """The node waits in a call, as for room in the send buffer of a socket: its timers skip
        ticks, and its other callbacks are held until ``unblock``."""
        self._alive, self._held = False, []
        for ticker in self._own_tickers():
            ticker.pause()
        for subscription in self._subscriptions:
            subscription.hold(self._held)

    def _own_tickers(self) -> list[Ticker]:
        """The timers, but for those of busy computers, which are their executors' matter."""
        return [ticker for ticker in self._tickers if isinstance(ticker, Ticker)]

    def unblock(self) -> None:
        """The call is over. A callback that is called now may block the node again; the timer that
        is due for longest has the first turn."""
        held, self._held = self._held or [], None
        self._alive = True
        for subscription in self._subscriptions:
            subscription.hold(None)
        for ticker in sorted(self._own_tickers(), key=attrgetter("due_ns")):
            ticker.resume()
        for k, (callback, arg) in enumerate(held):
            callback(arg)
            if self._held is not None:
                self._held[:0] = held[k + 1:]
                return

    @property
    def now_ns(self) -> int:
        """The time that the host's clock shows."""
        now_ns, clock = self._graph.kernel.now_ns, self.host.clock
        return now_ns if clock is None else clock.read(now_ns)

    @property
    def round(self) -> int:
        """The length of the chain of events of this instant that led to the present one."""
        return self._graph.kernel.round

    def advertise(self, topic: str, *, transport: str = "stream", latch: bool = False,
                  queue: int = 1, via: str = "unicast") -> Publisher:
        """``topic`` may be published from now on. ``transport``: stream or datagram; ``via``:
        unicast, or broadcast, which is always by datagram. ``queue`` bounds
        the outbox of each stream link (0: no bound). Returns the publisher."""
        publisher = self._publishers[topic] = self.host.advertise(
            self.name, self._absolute(topic), transport, via, queue, latch)
        return publisher

    def publish(self, topic: str, content: Content) -> None:
        """Send ``content`` to the present subscribers of ``topic``."""
        publisher = self._publishers.get(topic)
        if publisher is None:
            raise InputError(f"node {self.name!r} publishes {topic!r} without advertising it")
        publisher.publish(content)

    def has_subscribers(self, topic: str) -> bool:
        """Whether a message that this node publishes on ``topic`` would have a receiver."""
        return self._publishers[topic].has_subscribers()

    def subscribe(self, topic: str, callback: Callable[[Message], object], queue: int = 1) -> None:
        """Call ``callback(message)``, in phase CONTROL, for each message of ``topic``; ``queue``
        of them may wait, then the oldest goes (0: no bound)."""
        self._subscriptions.append(
            self.host.subscribe(self.name, self._absolute(topic), callback, queue))

    def latest(self, topic: str, wait_set: WaitSet | None = None) -> PolledSubscription:
        """Subscribe to ``topic`` without a callback: ``.read()`` of the result is the last one
        that has arrived, or None. ``wait_set`` finds it where there is news."""
        return self.host.latest(self.name, self._absolute(topic), wait_set)

    def timer(self, frequency_hz: Fraction | int, callback: Callable[[int], object],
              start: str = "random", name: str = "timer") -> Handle:
        """Call ``callback(k)`` at tick k. The first tick is now (``zero``) or after a part of the
        period that is drawn from the names of host, node and timer (``random``). Cost models know
        it by ``name``."""
        offset_ns = 0
        if start == "random":
            period_ns = int(NS_PER_S / Fraction(frequency_hz))
            offset_ns = self._graph.streams.integer(period_ns, *self._named, "timer",
                                                    len(self._tickers))
        elif start != "zero":
            raise InputError(f"a timer starts at 'random' or 'zero', not {start!r}")
        ticker = self.host.ticker(self.name, name, frequency_hz, callback,
                                  self._graph.kernel.now_ns + offset_ns)
        self._tickers.append(ticker)
        return ticker

    def after(self, delay_ns: int, callback: Callable[..., object], arg: object = None,
              name: str = "timer") -> Handle:
        """Call ``callback(arg)`` once, ``delay_ns`` from now. Cost models know it by ``name``."""
        return self.host.after(self.name, name, delay_ns, self._run, (callback, arg))

    def kept(self) -> Mapping[str, int]:
        """The quantities that the node keeps in memory now, besides messages, by the names of
        ``ports.computers.KEPT``."""
        return {}

    def stream(self, *name: str | int) -> np.random.Generator:
        """Random numbers by name, this node's own."""
        return self._graph.streams(*self._named, *name)

    def noise_key(self, *name: str | int) -> int:
        """A key for noise by counter (``desim.ports.kernels``), this node's own."""
        return self._graph.streams.key(*self._named, *name)

    def record(self, kind: str, a: int = 0, b: int = 0, c: int = 0) -> None:
        """Write a trace row of the namespace, and notify the listener to its kind."""
        graph = self._graph
        graph.trace.row(graph.kernel.now_ns, graph.names.id(kind), self._id, a, b, c)
        listener = graph.listeners.get(kind)
        if listener is not None:
            listener(self.namespace, a, b, c)

    @property
    def is_watched(self) -> bool:
        """Whether somebody looks at what ``display`` shows."""
        return self._graph.on_display is not None

    def display(self, kind: str, points_m: np.ndarray, texts: tuple[str, ...] = ()) -> None:
        """Show ``points_m`` [n, 2], with or without ``texts`` [n], to the one who looks at the run.
        No message is sent, and nothing in the run depends on it."""
        if self._graph.on_display is not None:
            self._graph.on_display(self.namespace, kind, points_m, texts)

    def _absolute(self, topic: str) -> str:
        """``topic`` in the namespace; with a leading slash it is absolute."""
        return topic if topic.startswith("/") else f"/{self.namespace}/{topic}"

    def _run(self, what: tuple[Callable[..., object], object]) -> None:
        if self._alive:
            callback, arg = what
            callback(arg)
        elif self._held is not None:
            self._held.append(what)
