"""The causes of messages that were late or lost, and equal ones in groups."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from desim.ports import TimePart
from desim.results.why import MessageFate

# Why nothing gets from one host to the other for a while.
_CUT = {"out_of_range": "out of reach", "out_of_reach": "out of reach", "no_path": "out of reach",
        "host_down": "host down", "outage": "outage", "partitioned": "partition",
        "jammed": "jammed", "not_associated": "no access point",
        "receiver_not_associated": "no access point", "roamed": "no access point",
        "access_point_down": "no access point"}
# Queues of radios under access points.
_QUEUES = {"codel": "CoDel at the sender", "downlink_codel": "CoDel at the access point",
           "downlink_queue_full": "full queue of the access point"}
_LOSSES = {**_CUT, **_QUEUES, "retry_limit": "no acknowledgement",
           "queue_full": "full queue on the way"}
_DROPS = {**_CUT, **_QUEUES, "outbox_full": "full outbox", "queue_full": "full queue",
          "send_buffer_full": "full send buffer", "history_full": "full history",
          "receive_buffer_full": "full receive buffer",
          "reassembly_full": "full reassembly buffer"}
_PARTS = {str(TimePart.SENDER): "held back by the sender",
          str(TimePart.CONTENTION): "busy channel"}


@dataclass(frozen=True)
class CauseGroup:
    """Messages with the same cause, in their order. ``cause``: in words, with the place where it
    has one; ``from_ns`` and ``until_ns``: the first and the last frame that was lost for it
    (None: no frame was)."""

    cause: str
    messages: tuple[MessageFate, ...]
    from_ns: int | None
    until_ns: int | None

    @property
    def born_ns(self) -> tuple[int, int]:
        """The first and the last birth of its messages."""
        times_ns = [message.born_ns for message in self.messages]
        return min(times_ns), max(times_ns)

    @property
    def latency_ns(self) -> tuple[int, int]:
        """The smallest and the greatest of their times from birth to fate."""
        times_ns = [message.latency_ns for message in self.messages]
        return min(times_ns), max(times_ns)


def grouped(messages: Iterable[MessageFate]) -> list[CauseGroup]:
    """The messages by cause, the greatest group first. Spans of lost frames that do not overlap
    are causes of their own."""
    known: dict[tuple[str, bool], list[MessageFate]] = {}
    for message in messages:
        known.setdefault(_cause(message), []).append(message)
    groups = [CauseGroup(cause, tuple(found), *_span(found, by_loss))
              for (cause, by_loss), alike in known.items()
              for found in (_overlapping(alike) if by_loss else [alike])]
    return sorted(groups, key=lambda group: -len(group.messages))


def _cause(message: MessageFate) -> tuple[str, bool]:
    """The cause in words, and whether lost frames are it."""
    lost, wait = message.frames_lost, message.association
    if wait is not None and 2 * wait.time_ns >= message.latency_ns:
        return f"{wait.host} waited for association with {wait.access_point}", False
    people = ", people between" if lost is not None and 2 * (
        lost.behind_people or 0) > lost.frames else ""
    if message.reason is not None:
        if message.reason == "outbox_full" and lost is not None and lost.reason in _CUT:
            return f"full outbox, {_CUT[lost.reason]}", True
        of_it = people if lost is not None and lost.reason == message.reason else ""
        return f"{_DROPS.get(message.reason, message.reason)}, {message.place}{of_it}", False
    greatest = max(message.parts, key=lambda part: part.time_ns, default=None)
    if greatest is None:
        return "no part of its time is known", False
    if lost is not None and (greatest.part == TimePart.RETRANSMISSION or
                             greatest.part == TimePart.SENDER and lost.reason in _CUT):
        place = f", {lost.place}" if lost.reason in _QUEUES and lost.place else ""
        return _LOSSES.get(lost.reason, f"frames lost ({lost.reason})") + place + people, True
    return f"{_PARTS.get(greatest.part, greatest.part)}, {greatest.place}", False


def _overlapping(messages: Sequence[MessageFate]) -> list[list[MessageFate]]:
    """The messages whose spans of lost frames overlap, together."""
    order = {id(message): i for i, message in enumerate(messages)}
    groups: list[list[MessageFate]] = []
    until_ns = -1
    for message in sorted(messages, key=lambda message: _span([message], True)):
        from_ns, last_ns = _span([message], True)
        assert from_ns is not None and last_ns is not None
        if from_ns > until_ns:
            groups.append([])
        groups[-1].append(message)
        until_ns = max(until_ns, last_ns)
    return [sorted(group, key=lambda message: order[id(message)]) for group in groups]


def _span(messages: Sequence[MessageFate], by_loss: bool) -> tuple[int | None, int | None]:
    spans = [message.frames_lost for message in messages if message.frames_lost is not None]
    if not by_loss:
        return None, None
    return min(span.from_ns for span in spans), max(span.until_ns for span in spans)
