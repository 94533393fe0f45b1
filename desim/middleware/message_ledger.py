"""The entries of the ledger while a run lasts: the parts of each message's time, or its loss."""

from __future__ import annotations

from struct import Struct

import numpy as np

from desim.middleware.busy.timed_executor import PublishingCallback
from desim.middleware.fates import OnFate
from desim.middleware.message import Message
from desim.network.passages import Passage, Passages, Stamp
from desim.ports import TimePart

# A row; its topic is an id, its fate an index into ``reasons``. A stamp; its part is one of
# ``PARTS``. No medium: -1.
ROW = np.dtype([(name, "<i8") for name in (
    "number", "topic", "seq", "source", "destination", "size_bytes", "born_ns", "fate", "end_ns",
    "medium", "host")])
STAMP = np.dtype([("part", "<i8"), ("medium", "<i8"), ("host", "<i8"), ("time_ns", "<i8")])
_pack_row, _pack_stamp = Struct("<11q").pack, Struct("<4q").pack
PARTS = tuple(TimePart)
_NUMBER = {part: number for number, part in enumerate(PARTS)}
# Reasons for which a message is dropped after it has arrived.
_AT_RECEIVER = frozenset({"no_subscriber", "unmatched", "overtaken", "reassembly_full",
                          "receive_buffer_full"})


class MessageLedger:
    """A ``Graph``'s ``on_fate`` that enters each message at each receiver: the parts of its time,
    or where it was lost. ``passages`` are those of the graph's media; ``further`` is notified of
    fates, too.

    ``callbacks`` are those of busy computers that published them: the graph's ``callbacks``.
    ``rows`` are of dtype ``ROW``, one for each message and receiver. ``stamps`` are of dtype
    ``STAMP``: of each row in turn, as many as ``counts`` says.

    The parts are those of the frame that completed the message. Until the data in this frame was
    first sent, the message was in the sender's queue; from then until this frame was sent, it was
    in retransmission; the frame's own parts follow. Where the frame was sent before the message's
    birth, to repair older data that comes first, only its parts after the birth count. Where hosts
    pass messages on, each hop has these parts.
    """

    def __init__(self, passages: Passages, further: OnFate | None = None) -> None:
        self.passages = passages
        self.callbacks: list[PublishingCallback] = []  # in order of time
        self.reasons = ["delivered"]
        self.rows: list[bytes] = []
        self.counts: list[int] = []
        self.stamps: list[bytes] = []
        self._further = further
        self._reason: dict[str | None, int] = {None: 0}

    def __call__(self, message: Message, receiver: int, time_ns: int, reason: str | None,
                 first_ns: int, last_ns: int) -> None:
        passages = self.passages
        passage = passages.expected.pop((message, receiver), None)
        medium, host, count = -1, message.origin.index, 0
        if reason is None:
            for stamp in parts_of(message, receiver, passage or passages.arriving, passages):
                self.stamps.append(_pack_stamp(_NUMBER[stamp.part], stamp.medium, stamp.host,
                                               stamp.time_ns))
                count += 1
        else:
            lost = passage or passages.losing
            if passages.arriving is not None and reason in _AT_RECEIVER:
                host = receiver
            elif lost is not None:
                medium, host = lost.medium, lost.place_of_loss(receiver)
        number = self._reason.get(reason)
        if number is None:
            number = self._reason[reason] = len(self.reasons)
            self.reasons.append(str(reason))
        self.rows.append(_pack_row(message.number, message.about.id, message.seq,
                                   message.origin.index, receiver, message.size_bytes,
                                   message.born_ns, number, time_ns, medium, host))
        self.counts.append(count)
        if self._further is not None:
            self._further(message, receiver, time_ns, reason, first_ns, last_ns)


def parts_of(message: Message, receiver: int, passage: Passage | None, passages: Passages
             ) -> list[Stamp]:
    """The parts of a message's time, from its birth until the frame that completed it arrives at
    ``receiver``, in order."""
    if passage is None:
        return []
    sender = passage.first.source
    if sender == message.origin.index:
        return _hop(message.born_ns, TimePart.SENDER, receiver, passage)
    before = passages.relays.get((message, sender))
    if before is None:  # a frame that another host sent: it has asked for what was missing
        return _hop(message.born_ns, TimePart.RETRANSMISSION, receiver, passage)
    came, came_ns = before
    return [*parts_of(message, sender, came, passages),
            *_hop(came_ns, TimePart.RELAY, receiver, passage)]


def _hop(since_ns: int, queue: TimePart, receiver: int, passage: Passage) -> list[Stamp]:
    """The parts of a message's time on one hop, from ``since_ns``, when the host that sends it had
    it. ``queue``: the part until its first transmission."""
    first = passage.first
    source, handed_ns = first.source, first.handed_ns
    after = [Stamp(first.held, -1, source, first.sent_ns - handed_ns), *passage.stamps(receiver)]
    if handed_ns < since_ns:
        return _since(since_ns - handed_ns, after)
    first_ns = max(first.first_ns, since_ns)
    return [stamp for stamp in (Stamp(queue, -1, source, first_ns - since_ns),
                                Stamp(TimePart.RETRANSMISSION, -1, source, handed_ns - first_ns),
                                *after) if stamp.time_ns]


def _since(gone_ns: int, stamps: list[Stamp]) -> list[Stamp]:
    """The rest of ``stamps`` when the first ``gone_ns`` of their time are left out."""
    left = []
    for stamp in stamps:
        over_ns = min(gone_ns, stamp.time_ns)
        gone_ns -= over_ns
        if stamp.time_ns > over_ns:
            left.append(stamp._replace(time_ns=stamp.time_ns - over_ns))
    return left
