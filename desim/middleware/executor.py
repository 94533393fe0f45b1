"""The thread of a node, which runs callbacks one at a time (roscpp's single-threaded spinner).

A callback is called when its thread first gets a processor. It reads what has arrived by then, and
declares its work, from which the cost model takes its processor time. Its messages are held back
until that time is over; meanwhile the thread calls nothing else, and queues fill. The end of a
callback is an event only if something depends on it: half of the callbacks of maze_30 publish
nothing, and no message arrives while they run.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping
from typing import TYPE_CHECKING, Protocol

from desim.computers.computer import Computer
from desim.computers.processors import Job
from desim.ports.arguments import check_work
from desim.ports.computers import QUANTITIES

if TYPE_CHECKING:
    from desim.middleware.contents import Content


class QueuedCallback(Protocol):
    """A callback in the queue of a node. ``trigger``: see ``ports.computers.Work``."""

    trigger: str

    @property
    def wants_end(self) -> bool:
        """Whether ``ended`` is to be called as soon as its time is over."""

    def run(self) -> int:
        """Call it. Returns the bytes of its message, 0 without one."""

    def ended(self) -> None:
        """Its time is over."""


class HeldPublication(Protocol):
    """A publisher whose messages leave later."""

    def release(self, content: Content) -> None:
        """Publish ``content`` now."""


class PolledSubscription(Protocol):
    """A subscription without a callback, which its node reads when it runs."""

    def charge_readers(self) -> bool:
        """Charge the nodes that read it for the receipt of what has arrived by now. Returns whether
        more messages may arrive without an event."""


class ExecutorHost(Protocol):
    """The host of an executor. ``calling``: the executor whose callback is being called now."""

    computer: Computer
    calling: Executor | None

    def called(self, node: str) -> None:
        """A callback of ``node`` has been called."""

    def wake(self, executor: Executor) -> None:
        """``executor`` has something in its queue, and may be idle."""


class Executor(Job):
    """Runs the callbacks of ``node``, a node of ``host``. ``program``: its name without its
    namespace, by which cost models know it.

    A message costs its receiver time, read or not. That time is added to ``owed_ns``, which the
    node spends before its next callback. The same holds for subscriptions without a callback: a
    node that spins at its own rate takes all that has arrived out of its sockets (ros::spinOnce).
    ``uncharged`` are those of them in which messages may have arrived that are not in ``owed_ns``.
    """

    __slots__ = ("node", "program", "receive_ns", "owed_ns", "uncharged", "queue", "current",
                 "idle", "_host", "_costs", "_processors", "_work", "_held")

    def __init__(self, node: str, program: str, host: ExecutorHost) -> None:
        super().__init__(host.computer.priorities.get(program, 0))
        self.node, self.program = node, program
        self._host, self._costs = host, host.computer.costs
        self._processors = host.computer.processors
        self.receive_ns = self._costs.receive_ns
        self.owed_ns = 0
        self.uncharged: dict[PolledSubscription, None] = {}
        self.queue: deque[QueuedCallback] = deque()
        self.current: QueuedCallback | None = None  # was called; its time may be over
        self._work: dict[str, int] = {}  # of it, as far as the node has declared it
        self._held: list[tuple[HeldPublication, Content]] = []  # published by it
        self.idle = True

    def runs(self, entry: QueuedCallback) -> bool:
        """Whether ``entry`` has been called and its time is not over. If so, its end is an event
        from now on."""
        return not (self.idle or self._is_free()) and self.current is entry

    def add(self, entry: QueuedCallback) -> None:
        """Append ``entry`` to the queue."""
        self.queue.append(entry)

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
        if self.queue and (self.idle or self._is_free()):
            self.idle = False
            self._submit()

    def _submit(self) -> None:
        self._processors.submit(self)

    def _is_free(self) -> bool:
        """Whether the current callback's time is over. If not, its end is an event from now on."""
        if not self.awaited:
            self._processors.attend(self)
        return self.idle

    def stop(self) -> None:
        """Forget everything: the process is gone."""
        self._processors.withdraw(self)
        self.queue.clear()
        self._held.clear()
        self.current, self.idle = None, False

    def worked(self, quantities: Mapping[str, int]) -> None:
        """The node declares work of the callback that is being called; see ``Node.worked``."""
        work = self._work
        for name, count in quantities.items():
            if name not in QUANTITIES or type(count) is not int or count < 0:
                check_work(f"node {self.node!r}", quantities)
            work[name] = work.get(name, 0) + count

    def hold(self, publisher: HeldPublication, content: Content, topic: str, links: int) -> None:
        """The callback publishes ``content`` on ``topic``, to so many ``links``."""
        self._held.append((publisher, content))
        if links:
            self.owed_ns += self._costs.send_ns(topic, content.size_bytes, links)

    def begin(self) -> int:
        if not self.queue:  # what there was to do was cancelled while it waited for a processor
            return 0
        entry = self.current = self.queue.popleft()
        if self._work:
            self._work = {}
        if self.uncharged:
            for subscription in tuple(self.uncharged):
                if not subscription.charge_readers():
                    del self.uncharged[subscription]
        self._host.calling = self
        size_bytes = entry.run()
        self._host.calling = None
        self._host.called(self.node)
        if size_bytes:
            self._work["bytes"] = size_bytes
        self.awaited = bool(self._held or self.queue) or entry.wants_end
        cost_ns = self.owed_ns + self._costs.of_callback_ns(self.program, entry.trigger, self._work)
        self.owed_ns = 0
        return cost_ns

    def end(self) -> None:
        entry, self.current = self.current, None
        self.idle = True
        if self._held:
            held, self._held = self._held, []
            for publisher, content in held:
                publisher.release(content)
        if entry is not None and entry.wants_end:
            entry.ended()
        if self.queue and self.awaited:  # else what came has a turn already
            self._host.wake(self)
