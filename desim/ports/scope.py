"""The scope of a rule: the hosts, links and topics that it acts on, and when it does.

Every rule has these parameters beside its own (``with_scope``), and its medium keeps to them.
"""

from __future__ import annotations

from collections.abc import Sequence
from fnmatch import fnmatchcase

from pydantic import Field, model_validator

from desim.errors import InputError, did_you_mean
from desim.ports.parameters import Params
from desim.units import DURATION, Duration, Period


def matching(pattern: str, hosts: tuple[str, ...], path: str) -> list[int]:
    """The indices of the hosts that a name or a pattern with * and ? means. ``InputError`` at the
    parameter ``path`` if there are none."""
    found = [index for index, host in enumerate(hosts) if fnmatchcase(host, pattern)]
    if not found:
        raise InputError(f"{path}: {pattern!r} names no host{did_you_mean(pattern, hosts)}; "
                         f"hosts are {', '.join(hosts)}")
    return found


def is_topic(topic: str, pattern: str, hosts: Sequence[str]) -> bool:
    """Whether ``pattern`` names ``topic``. ``*`` and ``?`` also stand for slashes. A pattern that
    does not begin with one is relative to a host."""
    if pattern.startswith("/"):
        return fnmatchcase(topic, pattern)
    _, host, *rest = topic.split("/", 2)
    return bool(rest) and host in hosts and fnmatchcase(rest[0], pattern)


class Topics(Params):
    """Topics, with all frames that carry their messages."""

    topics: list[str] = Field([], description=(
        "names or patterns with * and ?, which stand for slashes, too; scan is that of every host: "
        "all frames with data of these, no acknowledgements, discovery or other control frames "
        "(none: all frames)"))


class Targets(Params):
    """Hosts, with all that they send and receive, and links, in both directions."""

    hosts: list[str] = Field([], description=(
        "names or patterns with * and ?: all that these send and receive"))
    links: list[tuple[str, str]] = Field([], description=(
        "two of these each: all between them, in both directions"))

    @property
    def named(self) -> bool:
        """Whether it acts on some only."""
        return bool(self.hosts or self.links)

    def resolved(self, hosts: tuple[str, ...]) -> tuple[list[int], list[tuple[int, int]]]:
        """Indices of hosts, and of the two ends of links, the smaller one first; both in order.
        Raises ``InputError`` for a pattern that names none."""
        named = {index for number, pattern in enumerate(self.hosts)
                 for index in matching(pattern, hosts, f".hosts.{number}")}
        links: dict[tuple[int, int], None] = {}
        for number, (one, other) in enumerate(self.links):
            ends = [matching(pattern, hosts, f".links.{number}.{end}")
                    for end, pattern in enumerate((one, other))]
            found = {(min(a, b), max(a, b)): None for a in ends[0] for b in ends[1] if a != b}
            if not found:
                raise InputError(f".links.{number}: {one!r} and {other!r} name one host only")
            links |= found
        return sorted(named), sorted(links)


class TimeWindow(Params):
    """From ``from`` until ``until``, the latter not included, and where ``every`` is set again and
    again. A schedule without a period is several rules."""

    start_ns: Duration = Field("0 ns", alias="from", description="(the beginning)")
    until_ns: Duration | None = Field(None, description="null: for good")
    every_ns: Period | None = Field(None, description="from one beginning to the next (null: it "
                                                      "happens once)")

    @model_validator(mode="after")
    def _comes_to_an_end(self) -> TimeWindow:
        if self.until_ns is None:
            if self.every_ns is not None:
                raise ValueError("what happens every so often needs until")
        elif self.until_ns <= self.start_ns:
            raise ValueError(f"until must be later than from, got {DURATION.format(self.start_ns)} "
                             f"to {DURATION.format(self.until_ns)}")
        elif self.every_ns is not None and self.every_ns <= self.until_ns - self.start_ns:
            raise ValueError(f"every must be longer than what lies between from and until, "
                             f"{DURATION.format(self.until_ns - self.start_ns)}, got "
                             f"{DURATION.format(self.every_ns)}")
        return self

    @property
    def bounded(self) -> bool:
        """Whether the rule does not act all the time."""
        return self.start_ns > 0 or self.until_ns is not None

    def holds(self, now_ns: int) -> bool:
        """Whether the rule acts now."""
        since_ns = now_ns - self.start_ns
        if since_ns < 0:
            return False
        if self.every_ns is not None:
            since_ns %= self.every_ns
        return self.until_ns is None or since_ns < self.until_ns - self.start_ns

    def changes_ns(self, now_ns: int) -> int | None:
        """The time when it begins or ends to act next; None: never again."""
        if now_ns < self.start_ns:
            return int(self.start_ns)
        if self.until_ns is None:
            return None
        begun_ns: int = self.start_ns
        if self.every_ns is not None:
            begun_ns += (now_ns - begun_ns) // self.every_ns * self.every_ns
        if self.holds(now_ns):
            return begun_ns + int(self.until_ns - self.start_ns)
        return None if self.every_ns is None else begun_ns + int(self.every_ns)


SCOPE: tuple[type[Params], ...] = (TimeWindow, Topics, Targets)


def scope_beside(own: type[Params]) -> list[type[Params]]:
    """The parts of the scope that a rule with the parameters ``own`` is given. A part is left out
    if the rule has one of its keys itself."""
    taken = _keys(own)
    return [part for part in SCOPE if taken.isdisjoint(_keys(part))]


def with_scope(own: type[Params]) -> type[Params]:
    """The parameters ``own`` of a rule, and behind them its scope."""
    named = {"__module__": own.__module__, "__qualname__": own.__qualname__,
             "__doc__": own.__doc__}
    return type(own.__name__, (*scope_beside(own), own), named)


def _keys(block: type[Params]) -> set[str]:
    return {info.alias or name for name, info in block.model_fields.items()}
