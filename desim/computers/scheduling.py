"""Scheduling disciplines: which of the ready jobs run, and at which share of a processor."""

from __future__ import annotations

from bisect import insort
from typing import TYPE_CHECKING, NamedTuple, Protocol

if TYPE_CHECKING:
    from desim.computers.processors import Job


class Grant(NamedTuple):
    """The first ``jobs`` of the ready jobs run, each at ``processors / sharers`` of a processor."""

    jobs: int
    processors: int = 1
    sharers: int = 1


class Discipline(Protocol):
    """An order of the ready jobs, and which of them run if there are more of them than processors.
    Otherwise each job has a processor. (A new discipline also needs its name in ``DISCIPLINES``
    and in ``scenario/schema/computer.py``.)"""

    def enqueue(self, ready: list[Job], job: Job) -> None:
        """Put ``job``, which arrives now, into its place among the ``ready`` jobs."""

    def grant(self, ready: int, processors: int) -> Grant:
        """The shares of ``processors`` for ``ready`` jobs, which are more than these."""


class FirstInFirstOut:
    """A job runs until it is done, in the order of arrival. (M/D/1 and M/M/c are of this kind.)"""

    enqueue = staticmethod(list.append)

    def grant(self, ready: int, processors: int) -> Grant:
        return Grant(processors)


class FixedPriority:
    """The jobs with the highest priorities run, in order of arrival where they are equal, and one
    with a higher priority preempts another at once (Linux's SCHED_FIFO, sched(7))."""

    def enqueue(self, ready: list[Job], job: Job) -> None:
        insort(ready, job, key=lambda each: -each.priority)  # after its equals

    def grant(self, ready: int, processors: int) -> Grant:
        return Grant(processors)


class ProcessorSharing:
    """All jobs run at the same rate, none at more than one processor: the limit of short time
    slices (Linux's SCHED_OTHER with equal weights; Kleinrock 1976, section 4.4)."""

    enqueue = staticmethod(list.append)

    def grant(self, ready: int, processors: int) -> Grant:
        return Grant(ready, processors, ready)


DISCIPLINES: dict[str, type[Discipline]] = {
    "fifo": FirstInFirstOut, "fixed_priority": FixedPriority, "processor_sharing": ProcessorSharing}
