"""What a router knows of subscribers: those that each router has declared, and which count now."""

from __future__ import annotations

from bisect import insort
from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from desim.ports.middleware import MiddlewareContext


class Declaration(NamedTuple):
    """Of a subscriber, with the topic that it listens to, or of a liveliness token (no topic)."""

    size_bytes: int
    topic: str | None


class Part(NamedTuple):
    """Some of the declarations of ``router`` in one of its lives, from number ``first`` on."""

    router: int
    life: int
    first: int
    declarations: list[Declaration]


class Registry:
    """On one host. Nothing is ever undeclared: in desim what a host has lasts until it stops. What
    a router has declared counts while it is online, that is, while there is a way to it."""

    __slots__ = ("_own", "_context", "_declared", "_online", "_published", "_listeners")

    def __init__(self, own: int, life: int, context: MiddlewareContext) -> None:
        self._own = own
        self._context = context
        self._declared: dict[int, tuple[int, list[Declaration]]] = {own: (life, [])}
        self._online: dict[int, None] = {own: None}
        self._published: dict[str, None] = {}
        self._listeners: dict[str, list[int]] = {}  # of those online, ascending

    def listeners(self, topic: str) -> Sequence[int]:
        """Hosts that are known to listen to it now, ascending, the own one among them."""
        return self._listeners.get(topic, ())

    def publishes(self, topic: str) -> bool:
        """The own host publishes ``topic`` from now on. Whether that is new."""
        if topic in self._published:
            return False
        self._published[topic] = None
        for listener in self.listeners(topic):
            self._knows(listener, topic, True)
        return True

    def hears(self, topic: str) -> None:
        """The own host listens to ``topic``, and knows so before it is declared."""
        self._gain(self._own, [Declaration(0, topic)])

    def declare(self, declarations: list[Declaration]) -> None:
        """Of the own host, beside what it has declared before."""
        self._declared[self._own][1].extend(declarations)
        self._gain(self._own, declarations)

    def learn(self, part: Part) -> None:
        """What a neighbour tells, which begins within what is known or right behind it."""
        router, life, first, declarations = part
        self.begins(router, life)
        known_life, known = self._declared[router]
        if known_life == life:
            fresh = declarations[len(known) - first:]
            known.extend(fresh)
            if router in self._online:
                self._gain(router, fresh)

    def beyond(self, router: int, told: tuple[int, int]) -> Part | None:
        """What ``router`` has declared and a neighbour was not told: up to now so many in that
        life."""
        if router not in self._declared:
            return None
        life, declarations = self._declared[router]
        first = told[1] if told[0] == life else 0
        return Part(router, life, first, declarations[first:]) if declarations[first:] else None

    def begins(self, router: int, life: int) -> None:
        """It is in that life now: what it declared in an earlier one is void."""
        known_life, declarations = self._declared.get(router, (0, []))
        if known_life < life:
            self._lose(router, declarations)
            self._declared[router] = life, []

    def comes(self, router: int) -> None:
        """There is a way to ``router``."""
        self._online[router] = None
        self._context.sees(self._own, router, "online")
        self._gain(router, self._declared.get(router, (0, []))[1])

    def goes(self, router: int) -> None:
        """There is no way to ``router`` any more."""
        del self._online[router]
        self._context.sees(self._own, router, "offline")
        self._lose(router, self._declared.get(router, (0, []))[1])

    def _gain(self, router: int, declarations: list[Declaration]) -> None:
        for _, topic in declarations:
            listeners = self._listeners.setdefault(topic, []) if topic else None
            if listeners is not None and router not in listeners:
                insort(listeners, router)
                self._knows(router, topic, True)
                self._context.changed(topic)

    def _lose(self, router: int, declarations: list[Declaration]) -> None:
        for _, topic in declarations:
            if topic and router in self._listeners.get(topic, ()):
                self._listeners[topic].remove(router)
                self._knows(router, topic, False)
                self._context.changed(topic)

    def _knows(self, other: int, topic: str, holds: bool) -> None:
        if other != self._own and topic in self._published:
            self._context.knows(self._own, other, topic, holds)
