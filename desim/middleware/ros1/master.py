"""The ROS master: its registry, and its calls to subscribers.

Nothing expires: dead nodes stay registered until another one takes their name. All nodes of a host
count as one, with the host's name.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from functools import partial
from typing import NamedTuple


class Uri(NamedTuple):
    """The address of a host's nodes. Each time the host starts they listen on a new port, so that
    nobody answers at an address of an earlier ``life``."""

    host: int
    life: int

    @property
    def slave(self) -> str:
        """The service that takes XML-RPC calls."""
        return f"slave {self.life}"

    @property
    def tcpros(self) -> str:
        """The service that takes links."""
        return f"tcpros {self.life}"


class MasterRegistry:
    """The registrations at a master. ``nodes`` has the present address of each name (a host index);
    ``publishers`` and ``subscribers`` have addresses by topic and name, in order of registration.
    ``changes`` counts its changes."""

    def __init__(self) -> None:
        self.nodes: dict[int, Uri] = {}
        self.publishers: dict[str, dict[int, Uri]] = {}
        self.subscribers: dict[str, dict[int, Uri]] = {}
        self.changes = 0

    def register(self, side: dict[str, dict[int, Uri]], topic: str, uri: Uri) -> Uri | None:
        """Register ``uri`` on this ``side`` of ``topic``. If another one had its name, all
        registrations of that one are dropped, and it is returned (rosmaster registrations.py)."""
        old = self.nodes.get(uri.host)
        bumped = None if old in (None, uri) else old
        if bumped is not None:
            self.forget(uri.host)
        self.changes += 1
        self.nodes[uri.host] = uri
        side.setdefault(topic, {})[uri.host] = uri
        return bumped

    def unregister(self, side: dict[str, dict[int, Uri]], topic: str, uri: Uri) -> bool:
        """Unregister ``uri``. Returns whether it was registered. A node without registrations has
        no name to lose."""
        known = side.get(topic, {})
        if known.get(uri.host) != uri:
            return False
        self.changes += 1
        del known[uri.host]
        if not any(uri.host in known for side in (self.publishers, self.subscribers)
                   for known in side.values()):
            del self.nodes[uri.host]
        return True

    def forget(self, host: int) -> None:
        """Drop all registrations of this name."""
        self.nodes.pop(host, None)
        for side in (self.publishers, self.subscribers):
            for known in side.values():
                known.pop(host, None)

    def of(self, side: dict[str, dict[int, Uri]], topic: str) -> tuple[Uri, ...]:
        """The addresses that are registered on this ``side`` of ``topic``."""
        return tuple(side.get(topic, {}).values())


class MasterCall(NamedTuple):
    """A call that the master has to make: ``method`` is publisherUpdate or shutdown."""

    uri: Uri
    method: str
    topic: str
    publishers: tuple[Uri, ...]


MakeCall = Callable[[MasterCall, Callable[[], object]], object]


class IdleThreads:
    """The idle worker threads of a rosmaster. Each polls for work every ``period_ns`` since it fell
    asleep, at the instants ``asleep_ns`` (threadpool.py, threadSleepTime). Without a period they
    never sleep. ``at(time_ns, fn)`` calls ``fn()`` then."""

    def __init__(self, period_ns: int, asleep_ns: list[int], now: Callable[[], int],
                 at: Callable[[int, Callable[[], object]], object]) -> None:
        self._period_ns = period_ns
        self._asleep_ns = asleep_ns
        self._now, self._at = now, at
        self._booked = False

    def begin(self) -> None:
        """A thread becomes idle."""
        self._asleep_ns.append(self._now())

    def wake(self, works: Callable[[], bool]) -> None:
        """There is work: a thread that polls calls ``works()``, again and again while that returns
        that there was some."""
        if not self._asleep_ns or self._booked:
            return
        if not self._period_ns:
            self._take(0, works)
            return
        now_ns, period_ns = self._now(), self._period_ns
        waits_ns = [(asleep_ns - now_ns) % period_ns for asleep_ns in self._asleep_ns]
        first = waits_ns.index(min(waits_ns))
        self._booked = True
        self._at(now_ns + waits_ns[first], lambda: self._take(first, works))

    def _take(self, thread: int, works: Callable[[], bool]) -> None:
        self._booked = False
        asleep_ns = self._asleep_ns.pop(thread)
        if works():
            self.wake(works)
        else:
            self._asleep_ns.insert(thread, asleep_ns)


class MasterThreads:
    """The threads that make the master's calls in order, but never two at a time to the same node.
    ``call(task, done)`` has no timeout: a thread is busy until it is done. Then it takes the next
    call, or sleeps if there is none."""

    def __init__(self, threads: IdleThreads, call: MakeCall) -> None:
        self.waiting: deque[MasterCall] = deque()
        self.busy: dict[Uri, MasterCall] = {}
        self._threads, self._call = threads, call

    def add(self, task: MasterCall) -> None:
        self.waiting.append(task)
        self._threads.wake(self._work)

    def _work(self) -> bool:
        """Let a thread take the first call that may be made now. Returns whether there was one."""
        waiting, busy = self.waiting, self.busy
        for i, task in enumerate(waiting):
            if task.uri not in busy:
                del waiting[i]
                busy[task.uri] = task
                self._call(task, partial(self._done, task.uri))
                return True
        return False

    def _done(self, uri: Uri) -> None:
        del self.busy[uri]
        if not self._work():
            self._threads.begin()
        if self.waiting:
            self._threads.wake(self._work)


class Master:
    """One master process, from its start to its stop. ``call(task, done)`` makes its calls."""

    def __init__(self, threads: IdleThreads, call: MakeCall) -> None:
        self.registry = MasterRegistry()
        self.workers = MasterThreads(threads, call)

    def has_parameter(self, _: str, __: Uri) -> tuple[Uri, ...]:
        """None has been set."""
        return ()

    def published_topics(self, per_process: int | None, own: int) -> tuple[object, ...]:
        """All topics with a publisher; or so many for each process that has registered from another
        host than ``own``."""
        if per_process is not None:
            return (None,) * per_process * sum(host != own for host in self.registry.nodes)
        return tuple(topic for topic, known in self.registry.publishers.items() if known)

    def register_publisher(self, topic: str, uri: Uri) -> tuple[Uri, ...]:
        """Returns the subscribers; each of them gets all publishers."""
        registry = self.registry
        self._bump(registry.register(registry.publishers, topic, uri))
        self.notify(topic)
        return registry.of(registry.subscribers, topic)

    def register_subscriber(self, topic: str, uri: Uri) -> tuple[Uri, ...]:
        """Returns the publishers."""
        registry = self.registry
        self._bump(registry.register(registry.subscribers, topic, uri))
        return registry.of(registry.publishers, topic)

    def unregister_publisher(self, topic: str, uri: Uri) -> None:
        if self.registry.unregister(self.registry.publishers, topic, uri):
            self.notify(topic)

    def unregister_subscriber(self, topic: str, uri: Uri) -> None:
        self.registry.unregister(self.registry.subscribers, topic, uri)

    def notify(self, topic: str) -> None:
        """Call each subscriber of ``topic`` with all publishers."""
        registry = self.registry
        publishers = registry.of(registry.publishers, topic)
        for subscriber in registry.of(registry.subscribers, topic):
            self.workers.add(MasterCall(subscriber, "publisherUpdate", topic, publishers))

    def _bump(self, old: Uri | None) -> None:
        if old is not None:
            self.workers.add(MasterCall(old, "shutdown", "", ()))
