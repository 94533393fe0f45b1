"""What a participant remembers of another one."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

from desim.middleware.dds.asking import Asking

Guid = tuple[int, int]  # host index, and which of its lives: a new one at every start


class Item(NamedTuple):
    """What is told in discovery: that ``owner`` has a ``writer`` or a ``reader`` of ``topic``; one
    that every node has (``built_in_writer``, ``built_in_reader``; its topic if anybody's is
    matched); that there is a ``participant``, or that it is ``gone``."""

    owner: Guid
    kind: str
    topic: str
    size_bytes: int


class Remote:
    """``told`` of what it is to be told (``out``) has been sent, ``acked`` has arrived as far as is
    known; ``got`` of what it tells has come in order, ``held`` beyond that, ``known`` is there.

    ``wanted`` will be told again. ``answered``: it has acknowledged anything; ``asked``: a
    heartbeat of its has come. A server that has lost a client and meets it again tells it all anew,
    in another ``series`` (a participant without clients has one only, 0); ``heard_series`` is the
    one that this remote tells, ``named`` whom it has told of in that; ``beating``: heartbeats that
    are not answered; ``built_in``: what it has that every node has, ``greeted`` topics of it whose
    writer was heard; ``coming``: what will only say that it lives, as far as that is known to be
    on its way: when it is there, who hears it then, and what. Who is known only by hearsay
    of a server (``direct`` False) has neither lease nor telling of its own.
    """

    __slots__ = ("guid", "host", "lease_ns", "heard_ns", "direct", "writers", "readers", "out",
                 "told", "acked", "answered", "got", "held", "known", "asked", "answering",
                 "wanted", "asking", "series", "heard_series", "named", "greeted",
                 "beating", "built_in", "coming")

    def __init__(self, guid: Guid, lease_ns: int, heard_ns: int, direct: bool,
                 out: list[Item], series: int = 0) -> None:
        self.guid = guid
        self.host = guid[0]
        self.lease_ns = lease_ns
        self.heard_ns = heard_ns
        self.direct = direct
        self.writers: dict[str, None] = {}  # topics
        self.readers: dict[str, None] = {}
        self.out = out
        self.told = len(out)
        self.acked = 0
        self.answered = False
        self.got = self.known = 0
        self.held: dict[int, Item] = {}
        self.asked = self.answering = False
        self.asking = Asking()
        self.wanted: tuple[int, ...] = ()
        self.series = series
        self.heard_series = 0
        self.named: dict[Guid, None] = {}
        self.beating = 0
        self.built_in: dict[tuple[str, str], None] = {}
        self.greeted: dict[str, None] = {}
        self.coming: list[tuple[int, Callable[[Any, int], Any], Any]] = []

    def look(self, now_ns: int) -> None:
        """Take note of what has come before ``now_ns``."""
        coming, self.coming = self.coming, []
        for each in coming:
            if each[0] >= now_ns:
                self.coming.append(each)
            elif each[0] > self.heard_ns:
                self.heard_ns = each[0]

    def begin(self, series: int) -> None:
        """It tells all anew."""
        self.heard_series = series
        self.got = self.known = 0
        self.held.clear()
        self.named.clear()
        self.asking = Asking()
