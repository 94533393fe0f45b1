"""The thread of a node, which runs callbacks one at a time (roscpp's single-threaded spinner).

A callback is called when the thread first gets a processor: there it reads what has come by then,
and computes. What it costs shows then, too. Its messages are held back until that time is over;
meanwhile the thread calls nothing else, and queues fill. The end of a callback is an event only
where somebody waits for it (half of those of maze_30 say nothing, and no message comes meanwhile).
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
    def waits(self) -> bool:
        """Whether it wants to hear, right then, that its time is over, by ``over``."""

    def run(self) -> int:
        """Call it. Returns the bytes of its message, 0 without one."""

    def over(self) -> None:
        """Its time is over."""


class Holds(Protocol):
    """A publisher whose messages leave later."""

    def release(self, content: Content) -> None:
        """Publish ``content`` now."""


class Polled(Protocol):
    """A subscription that is read without a callback."""

    def settle(self) -> bool:
        """Let its readers owe the receipt of what has come by now. Returns whether more may come
        that nobody hears of."""


class Computes(Protocol):
    """The host of an executor. ``calling``: the executor whose callback is being called now."""

    computer: Computer
    calling: Executor | None

    def called(self, node: str) -> None:
        """A callback of ``node`` has been called."""

    def wake(self, executor: Executor) -> None:
        """``executor`` has something to do, and perhaps does nothing."""


class Executor(Job):
    """Runs the callbacks of ``node``, a node of ``host``.

    Messages cost receivers time when they have come, read or not: ``owed_ns``, which is spent
    before the node's next callback. So it is with subscriptions without a callback: a node that
    spins at its own rate takes out of the socket then what has come since (ros::spinOnce).
    ``unsettled``: those of them where messages may have come that are not owed yet.
    """

    __slots__ = ("node", "receive_ns", "owed_ns", "unsettled", "queue", "current", "idle",
                 "_host", "_costs", "_processors", "_work", "_held")

    def __init__(self, node: str, host: Computes) -> None:
        super().__init__(host.computer.priorities.get(node, 0))
        self.node = node
        self._host, self._costs = host, host.computer.costs
        self._processors = host.computer.processors
        self.receive_ns = self._costs.receive_ns
        self.owed_ns = 0
        self.unsettled: dict[Polled, None] = {}
        self.queue: deque[QueuedCallback] = deque()
        self.current: QueuedCallback | None = None  # was called; its time may be over
        self._work: dict[str, int] = {}  # of it, as far as the node has declared it
        self._held: list[tuple[Holds, Content]] = []  # published by it
        self.idle = True

    def runs(self, entry: QueuedCallback) -> bool:
        """Whether ``entry`` has been called and its time is not over. If so, its end is an event
        from now on."""
        return not (self.idle or self._is_free()) and self.current is entry

    def add_due(self, entry: QueuedCallback) -> None:
        """``entry`` waits for its turn. It is the computer's turn in phase CONTROL now."""
        self.queue.append(entry)
        self.step()

    def remove(self, entry: QueuedCallback) -> None:
        """``entry``, if it waits, is not to be called."""
        if entry in self.queue:
            self.queue.remove(entry)

    def step(self) -> None:
        """Ask for a processor, if there is something to do and nothing is being done."""
        if self.queue and (self.idle or self._is_free()):
            self.idle = False
            self._processors.submit(self)

    def _is_free(self) -> bool:
        """Whether the present callback's time is over. If not, its end is an event from now on."""
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

    def hold(self, publisher: Holds, content: Content, topic: str, links: int) -> None:
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
        if self.unsettled:
            for subscription in tuple(self.unsettled):
                if not subscription.settle():
                    del self.unsettled[subscription]
        self._host.calling = self
        size_bytes = entry.run()
        self._host.calling = None
        self._host.called(self.node)
        if size_bytes:
            self._work["bytes"] = size_bytes
        self.awaited = bool(self._held or self.queue) or entry.waits
        cost_ns = self.owed_ns + self._costs.of_callback_ns(self.node, entry.trigger, self._work)
        self.owed_ns = 0
        return cost_ns

    def end(self) -> None:
        entry, self.current = self.current, None
        self.idle = True
        if self._held:
            held, self._held = self._held, []
            for publisher, content in held:
                publisher.release(content)
        if entry is not None and entry.waits:
            entry.over()
        if self.queue and self.awaited:  # else what came has a turn already
            self._host.wake(self)
