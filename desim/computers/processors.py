"""The processors of a computer, on which jobs run; a job uses one of them at a time.

Time is in whole nanoseconds. Work is kept in small parts of a nanosecond (``_PARTS``), so that
rounding the shares of processors never shows in a result. A job leaves at the first whole
nanosecond at which its work is done.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from fractions import Fraction
from typing import TYPE_CHECKING

from desim.computers.scheduling import Discipline
from desim.engine.agenda import Call
from desim.engine.kernel import Kernel, Phase
from desim.errors import KernelError

if TYPE_CHECKING:
    from desim.computers.cluster_node import ClusterNode

Share = tuple[int, int]  # a quotient

_CONTROL = Phase.CONTROL  # looking a member up costs more than using it
_PARTS = 1 << 32  # of a nanosecond: a thousand events a second round off 0.02 ns of work in a day


class Job(ABC):
    """A piece of work for one processor. ``begin`` says how much, when it first gets one."""

    __slots__ = ("priority", "awaited", "over", "begun", "left", "since_ns", "due_ns")

    def __init__(self, priority: int = 0) -> None:
        self.priority = priority  # the highest first, where the discipline looks at it
        self.awaited = True  # else ``end`` is not called
        self.over = True  # its work is done, as far as processors have noticed; or none came yet
        self.begun = False
        self.left = 0  # work to be done yet, in parts
        # Of a job that has a processor to itself. (``left`` is not brought up to date meanwhile.)
        self.since_ns = 0  # when so much was left
        self.due_ns = 0  # when it is done

    @abstractmethod
    def begin(self) -> int:
        """The job gets a processor for the first time. Returns its work, ns at speed 1; from now on
        it is ``awaited`` or not."""

    @abstractmethod
    def end(self) -> object:
        """The work is done; called only if it was ``awaited``."""


class Processors:
    """``count`` processors of one ``speed``, which ``discipline`` gives to the jobs that are ready.

    Jobs begin and end in phase CONTROL; ``entity`` is the computer's, for the order inside an
    instant. ``cluster_node``: the node whose physical processors these share, if they are virtual
    and may have to wait; else None. Raises ``KernelError`` unless ``count`` is an int >= 1 and
    ``speed`` a Fraction > 0.

    While each job has a processor to itself, its end is known when it begins. Where one has to wait
    or to share, the work that is left of all jobs is brought up to date at each event.
    """

    __slots__ = ("count", "cluster_node", "_kernel", "_entity", "_order", "_enqueue", "_grant",
                 "_work_a_ns", "_parts_a_ns", "_ready", "_running", "_granted", "_physical",
                 "_share", "_has_left", "_done", "_since_ns", "_busy_ns", "_call", "_due_ns")

    def __init__(self, kernel: Kernel, entity: int, count: int, speed: Fraction,
                 discipline: Discipline) -> None:
        if type(count) is not int or count < 1 or type(speed) is not Fraction or speed <= 0:
            raise KernelError(f"processors have an int count >= 1 and a Fraction speed > 0, got "
                              f"{count!r} and {speed!r}")
        self.count = count
        self.cluster_node: ClusterNode | None = None
        self._kernel, self._entity, self._order = kernel, entity, _CONTROL + entity
        self._enqueue, self._grant = discipline.enqueue, discipline.grant
        # Parts that a processor does in a nanosecond, and those of a nanosecond of work at speed 1:
        self._work_a_ns = speed.numerator * _PARTS
        self._parts_a_ns = speed.denominator * _PARTS
        self._ready: list[Job] = []  # in the discipline's order
        # Each running job has the share ``_granted`` of a processor, each processor the share
        # ``_physical`` of a physical one. None: all of it, nobody waits. ``_share``: the product.
        self._granted: Share | None = None
        self._physical: Share | None = None
        self._share: Share | None = None
        # Where somebody waits: the number of jobs that run, the first ones, and up to when their
        # work is accounted for.
        self._running = 0
        self._since_ns = kernel.now_ns
        self._has_left = False  # a job has left since ``_dispatch``
        self._done: list[Job] = []  # awaited jobs whose ``end`` is still to be called
        self._busy_ns = 0
        self._call: Call | None = None  # of ``_end``
        self._due_ns = -1  # when it fires; -1: it has fired, or there is none

    @property
    def wanted(self) -> int:
        """The number of processors that have jobs."""
        return min(len(self._ready), self.count)

    def alone_ns(self, work_ns: int) -> int:
        """The time that so much work takes on a processor that it has to itself."""
        return -(-work_ns * self._parts_a_ns // self._work_a_ns)

    def busy_ns(self) -> int:
        """The time for which processors have had jobs so far, summed over all of them. (Virtual
        ones have them, too, while they wait for a physical one.)"""
        now_ns = self._kernel.now_ns
        if self._share is not None:
            return self._busy_ns + (now_ns - self._since_ns) * min(self._running, self.count)
        return self._busy_ns + sum([min(now_ns, job.due_ns) - job.since_ns for job in self._ready])

    def submit(self, job: Job) -> None:
        """``job`` is ready."""
        job.awaited, job.over = True, False
        ready = self._ready
        if self._share is not None or self.cluster_node is not None or len(ready) >= self.count:
            self.advance()
            if self._share is not None or self.cluster_node is not None or len(ready) >= self.count:
                job.begun = False
                self._enqueue(ready, job)
                self._dispatch()
                return
        # It has a processor to itself.
        left = job.begin() * self._parts_a_ns
        if not left:
            self._finish(job)
            return
        self._enqueue(ready, job)
        job.begun, job.left = True, left
        job.since_ns = now_ns = self._kernel.now_ns
        job.due_ns = due_ns = now_ns - -left // self._work_a_ns
        if job.awaited:
            if self._due_ns < 0 and self._call is not None:  # as most often
                self._kernel.again(due_ns, self._order, self._call)
                self._due_ns = due_ns
            elif not 0 <= self._due_ns <= due_ns:
                self._book_at(due_ns)

    def attend(self, job: Job) -> bool:
        """From now on ``job`` is awaited, unless it is done. Returns whether it is done."""
        if self._share is not None:
            self.advance()
            if not job.over:
                job.awaited = True
            self._book()
        elif job.due_ns <= self._kernel.now_ns:
            self._leave(job)
        else:
            job.awaited = True
            if not 0 <= self._due_ns <= job.due_ns:
                self._book_at(job.due_ns)
        return job.over

    def withdraw(self, job: Job) -> None:
        """Remove ``job``, if it is ready, without calling its ``end``."""
        self.advance()
        if job in self._ready:
            self._ready.remove(job)
            if self._share is None:
                self._busy_ns += self._kernel.now_ns - job.since_ns
        if job in self._done:
            self._done.remove(job)
        self._dispatch()

    def set_physical_share(self, share: Share | None) -> None:
        """From now on each processor has this share of a physical one; None: all of one."""
        self.advance()
        if self._share is None:  # jobs have ended since ``_dispatch``
            self._running = len(self._ready)
        self._physical = share
        self._set_share()
        self._book()

    def advance(self) -> None:
        """Account for the work that has been done since the last event."""
        now_ns, ready = self._kernel.now_ns, self._ready
        if self._share is None:
            for job in ready[:]:
                if job.due_ns <= now_ns:
                    self._leave(job)
            return
        elapsed_ns = now_ns - self._since_ns
        if not elapsed_ns:
            return
        self._busy_ns, self._since_ns = self.busy_ns(), now_ns
        work = elapsed_ns * self._work_a_ns * self._share[0] // self._share[1]
        for job in ready[:self._running]:
            job.left -= work
            if job.left <= 0:  # nothing can preempt it any more
                self._running -= 1
                self._has_left = True
                self._leave(job)

    def _leave(self, job: Job) -> None:
        """The work of ``job`` is done."""
        self._ready.remove(job)
        if self._share is None:
            self._busy_ns += job.due_ns - job.since_ns
        if job.awaited:
            self._done.append(job)
        else:
            job.over = True

    def _begins(self, job: Job) -> None:
        """``job``, which is ready, begins."""
        job.begun = True
        job.left = job.begin() * self._parts_a_ns
        if not job.left:
            self._ready.remove(job)
            self._finish(job)
            return
        job.since_ns = now_ns = self._kernel.now_ns
        job.due_ns = now_ns - -job.left // self._work_a_ns

    def _finish(self, job: Job) -> None:
        """``job`` is over."""
        job.over = True
        if job.awaited:
            job.end()

    def _dispatch(self) -> None:
        """Let the jobs that are the first now run."""
        ready = self._ready
        while True:
            if len(ready) <= self.count:
                self._running, self._granted = len(ready), None
            else:
                self._running, *share = self._grant(len(ready), self.count)
                self._granted = share[0], share[1]
            for job in ready[:self._running]:
                if not job.begun:
                    break
            else:
                break
            self._begins(job)
        self._has_left = False
        self._set_share()
        if self.cluster_node is not None:
            self.cluster_node.share_out()
        self._book()

    def _set_share(self) -> None:
        """Let jobs run at their present share; their work so far is accounted for."""
        granted, physical, before = self._granted, self._physical, self._share
        self._share = granted if physical is None else physical if granted is None else (
            granted[0] * physical[0], granted[1] * physical[1])
        now_ns = self._kernel.now_ns
        if before is None and self._share is not None:
            self._since_ns = now_ns
            for job in self._ready:
                if job.begun:
                    self._busy_ns += now_ns - job.since_ns
                    job.left -= (now_ns - job.since_ns) * self._work_a_ns
        elif before is not None and self._share is None:
            for job in self._ready:
                job.since_ns, job.due_ns = now_ns, now_ns - -job.left // self._work_a_ns

    def _book(self) -> None:
        """Book the end of the job that will be done first: of awaited jobs or, if somebody waits
        for a processor, of all."""
        now_ns = self._kernel.now_ns
        if self._done or (self._has_left and self._share is not None):
            due_ns = now_ns
        elif self._share is None:
            due_ns = min([job.due_ns for job in self._ready if job.awaited], default=-1)
        else:
            least = min([job.left for job in self._ready[:self._running]], default=0)
            processors, sharers = self._share
            due_ns = now_ns - -least * sharers // (self._work_a_ns * processors) if least else -1
        if due_ns != self._due_ns:
            self._book_at(due_ns)

    def _book_at(self, due_ns: int) -> None:
        """Have ``_end`` called then, and not before; -1: not at all."""
        kernel, call = self._kernel, self._call
        if call is not None and self._due_ns >= 0:
            call.cancel()
            self._call = call = None
        self._due_ns = due_ns
        if due_ns >= 0:
            if call is not None and due_ns > kernel.now_ns:
                kernel.again(due_ns, self._order, call)
            else:
                self._call = kernel.at(due_ns, _CONTROL, self._entity, self._end)

    def _end(self, _: object) -> None:
        self._due_ns = -1
        if self._share is not None or self._done:
            self.advance()
            done, self._done = self._done, []
            for job in done:
                self._finish(job)
            self._dispatch()
            return
        # Nobody waits for a processor that gets free.
        now_ns, ready = self._kernel.now_ns, self._ready
        for job in ready[:]:
            if job.due_ns <= now_ns:
                ready.remove(job)
                self._busy_ns += job.due_ns - job.since_ns
                job.over = True
                if job.awaited:
                    job.end()
        if ready:
            self._book()
