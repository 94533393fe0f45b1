"""A computer on which callbacks take time."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from fractions import Fraction
from typing import TYPE_CHECKING, Any

from desim.computers.computer import Computer
from desim.engine.kernel import Phase
from desim.errors import KernelError
from desim.middleware.busy.endpoints import (
    BusyPolledSubscription,
    HeldPublisher,
    QueuedSubscription,
)
from desim.middleware.busy.executor import Executor
from desim.middleware.busy.memory import HostMemory
from desim.middleware.busy.timed_executor import TimedExecutor
from desim.middleware.busy.timers import BusyTimer, OneShot
from desim.middleware.host import MAX_CALLBACKS, Host
from desim.middleware.message import Message
from desim.middleware.topics import PolledSubscription, Publisher, Subscription, Topic, WaitSet
from desim.ports.middleware import Advertisement
from desim.ports.networks import Handle

if TYPE_CHECKING:
    from desim.middleware.graph import Graph
    from desim.network.medium import Medium


_CONTROL = Phase.CONTROL  # looking a member up costs more than using it


class BusyHost(Host):
    """A host whose callbacks run on the processors of ``computer``, those of a node one at a time.

    Nothing else takes time there: neither frames, nor the middleware's own messages, nor drivers,
    which stand for sensors and motors. ``after_callback`` gets the name of the node after each
    callback, and checks the limit of memory, if there is one.
    """

    __slots__ = ("computer", "memory", "after_callback", "programs", "_executors",
                 "_timers", "_missed_ticks", "_subscriptions", "_ends_by_node", "_awake", "_booked")

    computer: Computer

    def __init__(self, graph: Graph, name: str, index: int, computer: Computer) -> None:
        super().__init__(graph, name, index)
        self.computer = computer
        self._missed_ticks = 0  # of callbacks that are over
        self._timers: list[BusyTimer] = []
        self.programs: dict[str, None] = {}  # that have run here, in the order of their starts
        self._executors: dict[str, Executor] = {}  # by node
        self._subscriptions: list[QueuedSubscription] = []
        self._ends_by_node: dict[str, list[QueuedSubscription | HeldPublisher]] = {}
        self._awake: list[Executor] = []  # one turn each, in order
        self._booked = False
        self.memory = memory = (None if computer.memory is None
                                else HostMemory(self, computer.memory))
        self.after_callback: Callable[[str], object] | None = (
            None if memory is None or memory.limit_bytes is None else memory.check_limit)

    @property
    def executors(self) -> Collection[Executor]:
        """The threads of its nodes, since its software started."""
        return self._executors.values()

    @property
    def missed_ticks(self) -> int:
        """The ticks that its timers have missed so far, those of nodes that are still busy, too."""
        return self._missed_ticks + sum([timer.overdue_ticks() for timer in self._timers])

    def ticker(self, node: str, name: str, frequency_hz: Fraction | int,
               callback: Callable[[int], object], start_ns: int) -> Handle:
        timer = BusyTimer(self.graph.kernel, self.id, self._executor(node), name, frequency_hz,
                          callback, start_ns, self._missed)
        self._timers.append(timer)
        return timer

    def after(self, node: str, name: str, delay_ns: int, fn: Callable[..., object], arg: object
              ) -> Handle:
        return OneShot(self.graph.kernel, self.id, self._executor(node), name, delay_ns, fn, arg)

    def latest(self, node: str, topic: str, wait_set: WaitSet | None) -> PolledSubscription:
        latest = super().latest(node, topic, wait_set)
        assert isinstance(latest, BusyPolledSubscription)  # ``_new_latest`` has made it
        latest.read_by(self._executor(node))
        return latest

    def receive(self, message: Message) -> bool:
        ends = self._ends.get(message.about.name)
        if ends is None:
            return False
        latest, subscriptions = ends
        if latest is not None:
            latest.put(message)
        if subscriptions:
            message.about.counts.queued += len(subscriptions)
            queued: Sequence[Any] = subscriptions  # QueuedSubscription: see ``_new_subscription``
            for subscription in queued:
                subscription.put(message)
        return True

    def worked(self, **quantities: int) -> None:
        """See ``Node.worked``."""
        if self.calling is not None:
            self.calling.worked(quantities)

    def wake(self, executor: Executor) -> None:
        """Let ``executor`` take its next turn in phase CONTROL, after those that came before."""
        self._awake.append(executor)
        if not self._booked:
            self._booked = True
            self.graph.kernel.after(0, _CONTROL, self.id, self._take_turns)

    def program(self, node: str) -> str:
        """The name of ``node`` without its namespace: ``slam`` of ``robot_3/slam``."""
        return node.rpartition("/")[2]

    def readers(self, topic: str) -> int:
        """The number of connections to nodes of this host that subscribe to ``topic``."""
        polled, subscriptions = self._ends_of(topic)
        readers = polled.readers if isinstance(polled, BusyPolledSubscription) else ()
        return len(subscriptions) + len(readers)

    def waiting_bytes(self, node: str) -> int:
        """The bytes of the messages of ``node`` that wait: for its callbacks, and at each link on
        which they have not arrived."""
        return sum([end.waiting_bytes() for end in self._ends_by_node.get(node, ())])

    def block(self, node: str) -> None:
        self._executor(node).block()

    def unblock(self, node: str) -> None:
        self._executor(node).unblock()

    def _end(self, media: Sequence[Medium]) -> None:
        for executor in self._executors.values():
            executor.stop()
        for subscription in self._subscriptions:
            subscription.discard()
        self._missed_ticks = self.missed_ticks
        self._timers.clear()
        self._executors.clear()
        self._subscriptions.clear()
        self._ends_by_node.clear()
        self._awake.clear()
        if self.memory is not None:
            self.memory.freed()
        super()._end(media)

    def _new_publisher(self, topic: Topic, advertised: Advertisement) -> Publisher:
        publisher = HeldPublisher(self, topic, advertised)
        self._ends_by_node.setdefault(advertised.publisher.node, []).append(publisher)
        return publisher

    def _new_subscription(self, node: str, topic: Topic, callback: Callable[[Message], object],
                          queue: int) -> Subscription:
        subscription = QueuedSubscription(self, self._executor(node), topic, callback, queue)
        self._subscriptions.append(subscription)
        self._ends_by_node.setdefault(node, []).append(subscription)
        return subscription

    def _new_latest(self, topic: str, wait_set: WaitSet | None) -> PolledSubscription:
        return BusyPolledSubscription(self, topic, wait_set)

    def _executor(self, node: str) -> Executor:
        """The thread of the node called ``node``."""
        if node not in self._executors:
            callbacks, program = self.graph.callbacks, self.program(node)
            self.programs[program] = None
            self._executors[node] = (Executor(node, program, self) if callbacks is None
                                     else TimedExecutor(node, program, self, callbacks))
        return self._executors[node]

    def _missed(self, ticks: int) -> None:
        self._missed_ticks += ticks

    def _take_turns(self, _: object) -> None:
        awake = self._awake
        for _ in range(MAX_CALLBACKS):
            if not awake:
                self._booked = False
                return
            awake.pop(0).step()
        raise KernelError(f"more than {MAX_CALLBACKS} callbacks on {self.name} at "
                          f"{self.graph.kernel.now_ns} ns: they cost nothing and wake each other")
