"""Scheduling disciplines: which of the jobs that are ready run, and at which share of a processor.
"""

from __future__ import annotations

from bisect import insort
from typing import TYPE_CHECKING, NamedTuple, Protocol

if TYPE_CHECKING:
    from desim.computers.processors import Job


class Grant(NamedTuple):
    """The first ``jobs`` of those that are ready run, each at ``processors / sharers`` of a
    processor."""

    jobs: int
    processors: int = 1
    sharers: int = 1


class Discipline(Protocol):
    """An order of the jobs that are ready, and how many of them run where there are more than
    processors. Otherwise each has one."""

    def enqueue(self, ready: list[Job], job: Job) -> None:
        """Put ``job``, which arrives now, into its place among those that are ``ready``."""

    def grant(self, ready: int, processors: int) -> Grant:
        """Shares of ``processors`` for so many ``ready`` jobs, which are more."""


class FirstInFirstOut:
    """A job runs until it is done, in the order of arrival. (M/D/1 and M/M/c are of this kind.)"""

    def enqueue(self, ready: list[Job], job: Job) -> None:
        ready.append(job)

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
    """All jobs run at the same rate, none at more than one processor: what time slices come to when
    they are short (Linux's SCHED_OTHER with equal weights; Kleinrock 1976, section 4.4)."""

    def enqueue(self, ready: list[Job], job: Job) -> None:
        ready.append(job)

    def grant(self, ready: int, processors: int) -> Grant:
        return Grant(ready, processors, ready)


DISCIPLINES: dict[str, type[Discipline]] = {
    "fifo": FirstInFirstOut, "fixed_priority": FixedPriority, "processor_sharing": ProcessorSharing}
