"""The thread of a node, which runs callbacks one at a time (roscpp's single-threaded spinner).

A callback is called when its thread first gets a processor. It reads what has arrived by then, and
declares its work, from which the cost model takes its processor time. Its messages are held back
until that time is over; meanwhile the thread calls nothing else, and queues fill. The end of a
callback is an event only if something depends on it: half of the callbacks of maze_30 publish
nothing, and no message arrives while they run.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Protocol

from desim.computers.processors import Job
from desim.ports.arguments import check_work
from desim.ports.computers import QUANTITIES

if TYPE_CHECKING:
    from desim.middleware.busy.endpoints import BusyPolledSubscription, HeldPublisher
    from desim.middleware.busy.host import BusyHost
    from desim.middleware.contents import Content


class QueuedCallback(Protocol):
    """A callback in the queue of a node. ``cost_ns`` gives its time, from its work."""

    @property
    def cost_ns(self) -> Callable[[Mapping[str, int]], int]:
        """``CostModel.callback_ns`` of its node and trigger."""

    @property
    def wants_end(self) -> bool:
        """Whether ``ended`` is to be called as soon as its time is over."""

    def run(self) -> int:
        """Call it. Returns the bytes of its message, 0 without one."""

    def ended(self) -> None:
        """Its time is over."""


class Executor(Job):
    """Runs the callbacks of ``node``, a node of ``host``. ``program``: its name without its
    namespace, by which cost models know it.

    A message costs its receiver time, read or not. That time is added to ``owed_ns``, which the
    node spends with its next callback. The same holds for subscriptions without a callback: a node
    that spins at its own rate takes all messages out of its sockets (ros::spinOnce). ``uncharged``:
    subscriptions of this kind that may have messages whose time is not in ``owed_ns`` yet.
    ``computing_ns``: the time of all callbacks so far, at speed 1; that of a callback is added when
    it is called.
    """

    __slots__ = ("node", "program", "receive_ns", "send_ns", "owed_ns", "uncharged", "queue", "add",
                 "current", "held", "computing_ns", "host", "_processors", "_work")

    def __init__(self, node: str, program: str, host: BusyHost) -> None:
        super().__init__(host.computer.priorities.get(program, 0))
        self.node, self.program = node, program
        self.host, self._processors = host, host.computer.processors
        costs = host.computer.costs
        self.receive_ns, self.send_ns = costs.receive_ns, costs.send_ns
        self.owed_ns = self.computing_ns = 0
        self.uncharged: dict[BusyPolledSubscription, None] = {}
        self.queue: list[QueuedCallback] = []  # short: a deque would fill more of the caches
        self.add: Callable[[QueuedCallback], object] = self.queue.append
        self.current: QueuedCallback | None = None  # was called; its time may be over
        self._work: dict[str, int] = {}  # of it, as far as the node has declared it
        self.held: list[tuple[HeldPublisher, Content]] = []  # published by it

    def cost_of(self, trigger: str) -> Callable[[Mapping[str, int]], int]:
        """``CostModel.callback_ns`` of this node, as a function of the quantities."""
        return self.host.computer.costs.of_callback(self.program, trigger)

    def runs(self, entry: QueuedCallback) -> bool:
        """Whether ``entry`` has been called and its time is not over. If so, its end is an event
        from now on."""
        return not self._is_free() and self.current is entry

    def add_due(self, entry: QueuedCallback) -> None:
        """Append ``entry``, and ask for a processor. To be called in the computer's turn of phase
        CONTROL."""
        self.add(entry)
        self.step()

    def remove(self, entry: QueuedCallback) -> None:
        """Take ``entry`` out of the queue, if it is there."""
        if entry in self.queue:
            self.queue.remove(entry)

    def step(self) -> None:
        """Ask for a processor, if a callback waits and none is running."""
        if self.queue and (self.over or self._is_free()):
            self.current = None
            self._processors.submit(self)

    def _is_free(self) -> bool:
        """Whether the current callback's time is over. If not, its end is an event from now on."""
        return self.over or not self.awaited and self._processors.attend(self)

    def block(self) -> None:
        """The node waits in a call, as for room in the send buffer of a socket. That is in the end
        of a callback, when it publishes; a driver, which publishes beside its callbacks, goes on.
        """
        if self.over:
            self.over, self.awaited = False, True

    def unblock(self) -> None:
        """The call is over."""
        if self.current is None and not self.over and self.awaited:
            self.over = True
            if self.queue:
                self.host.wake(self)

    def stop(self) -> None:
        """Forget everything: the process is gone."""
        self._processors.withdraw(self)
        self.queue.clear()
        self.held.clear()
        self.current, self.over = None, False  # it is never free again

    def worked(self, quantities: Mapping[str, int]) -> None:
        """The node declares work of the callback that is being called; see ``Node.worked``."""
        for name, count in quantities.items():
            if name not in QUANTITIES or type(count) is not int or count < 0:
                check_work(f"node {self.node!r}", quantities)
        work = self._work
        if not work:
            self._work = dict(quantities)
            return
        for name, count in quantities.items():
            work[name] = work.get(name, 0) + count

    def begin(self) -> int:
        queue, host = self.queue, self.host
        if not queue:  # its callback was cancelled while it waited for a processor
            return 0
        entry = self.current = queue.pop(0)
        if self.uncharged:
            for subscription in tuple(self.uncharged):
                if not subscription.charge_readers():
                    del self.uncharged[subscription]
        host.calling = self
        size_bytes = entry.run()
        host.calling = None
        if host.after_callback is not None:
            host.after_callback(self.node)
        work = self._work
        if size_bytes:
            work["bytes"] = size_bytes
        self.awaited = True if self.held or queue else entry.wants_end
        cost_ns = self.owed_ns + entry.cost_ns(work)
        self.owed_ns = 0
        self.computing_ns += cost_ns
        if work:
            self._work = {}
        return cost_ns

    def end(self) -> None:
        entry, self.current = self.current, None
        held = self.held
        if held:
            for publisher, content in held:
                publisher.release(content)
            held.clear()
        if entry is not None and entry.wants_end:
            entry.ended()
        if self.queue:
            self.host.wake(self)
