"""The thread of a node whose callbacks are timed, on a busy computer of a run with a ledger."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from desim.middleware.busy.executor import Executor, QueuedCallback

if TYPE_CHECKING:
    from desim.middleware.busy.host import BusyHost


class PublishingCallback(NamedTuple):
    """A callback of ``node`` that published the messages number ``first`` to ``last``, and the
    parts of the time from when it was due until their birth.

    ``node_queue_ns``: the node ran the callbacks before it. ``computing_ns``: the callback's time
    with a processor to itself. ``run_queue_ns``: what it took longer, because others had the
    processor, or shared or preempted it. ``called_ns``: the instant of its call, when it reads what
    has arrived."""

    first: int
    last: int
    node: str
    called_ns: int
    node_queue_ns: int
    run_queue_ns: int
    computing_ns: int


class TimedExecutor(Executor):
    """An executor that appends its callbacks to ``log`` if they publish messages between hosts."""

    __slots__ = ("_graph", "_log", "_due", "_due_ns", "_turn_ns", "_called_ns", "_computing_ns")

    def __init__(self, node: str, program: str, host: BusyHost,
                 log: list[PublishingCallback]) -> None:
        super().__init__(node, program, host)
        self._graph, self._log = host.graph, log
        self._due: list[int] = []  # since when each entry of the queue is there
        self.add = self._add
        # Of the current callback:
        self._due_ns = self._turn_ns = self._called_ns = self._computing_ns = 0

    def step(self) -> None:
        if self.queue and self._is_free():
            self._turn_ns = self._graph.kernel.now_ns
        super().step()

    def remove(self, entry: QueuedCallback) -> None:
        if entry in self.queue:
            del self._due[self.queue.index(entry)]
        super().remove(entry)

    def stop(self) -> None:
        self._due.clear()
        super().stop()

    def begin(self) -> int:
        self._called_ns = self._graph.kernel.now_ns
        if self._due:
            self._due_ns = self._due.pop(0)
        cost_ns = super().begin()
        self._computing_ns = self._processors.alone_ns(cost_ns)
        return cost_ns

    def end(self) -> None:
        before = self._graph.messages
        super().end()
        last = self._graph.messages
        if last > before:
            run_queue_ns = self._graph.kernel.now_ns - self._turn_ns - self._computing_ns
            self._log.append(PublishingCallback(
                before + 1, last, self.node, self._called_ns, self._turn_ns - self._due_ns,
                run_queue_ns, self._computing_ns))

    def _add(self, entry: QueuedCallback) -> None:
        self._due.append(self._graph.kernel.now_ns)
        self.queue.append(entry)
