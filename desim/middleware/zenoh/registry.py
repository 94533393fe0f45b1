"""The subscribers that a router knows: those that each router has declared, while it is online."""

from __future__ import annotations

from bisect import insort
from collections.abc import Sequence
from typing import NamedTuple

from desim.ports.middleware import HostState, MiddlewareContext


class Declaration(NamedTuple):
    """The declaration of a subscriber to ``topic``, or of a liveliness token (no topic)."""

    size_bytes: int
    topic: str | None


class Part(NamedTuple):
    """Some of the declarations of ``router`` in one of its lives, from number ``first`` on."""

    router: int
    life: int
    first: int
    declarations: list[Declaration]


class DeclarationRegistry:
    """The declarations that one host knows. Nothing is ever undeclared: in desim, a host's
    endpoints last until it stops. Declarations of a router count while it is online, that is, while
    there is a way to it."""

    def __init__(self, own: int, life: int, context: MiddlewareContext) -> None:
        self._own = own
        self._context = context
        self._declared: dict[int, tuple[int, list[Declaration]]] = {own: (life, [])}
        self._online: dict[int, None] = {own: None}
        self._published: dict[str, None] = {}
        self._listeners: dict[str, list[int]] = {}  # of those online, ascending

    def listeners(self, topic: str) -> Sequence[int]:
        """The hosts that are known to subscribe to ``topic`` now, ascending; the own host may be
        among them."""
        return self._listeners.get(topic, ())

    def publishes(self, topic: str) -> bool:
        """The own host publishes ``topic`` from now on. Returns whether that is new."""
        if topic in self._published:
            return False
        self._published[topic] = None
        for listener in self.listeners(topic):
            self._knows(listener, topic, True)
        return True

    def listens(self, topic: str) -> None:
        """The own host subscribes to ``topic``, and knows that before it is declared."""
        self._gain(self._own, [Declaration(0, topic)])

    def declare(self, declarations: list[Declaration]) -> None:
        """Add declarations of the own host."""
        self._declared[self._own][1].extend(declarations)
        self._gain(self._own, declarations)

    def learn(self, part: Part) -> None:
        """Take declarations from a neighbour. They begin within the known ones or directly after
        them."""
        router, life, first, declarations = part
        self.begins(router, life)
        known_life, known = self._declared[router]
        if known_life == life:
            fresh = declarations[len(known) - first:]
            known.extend(fresh)
            if router in self._online:
                self._gain(router, fresh)

    def beyond(self, router: int, sent: tuple[int, int]) -> Part | None:
        """The declarations of ``router`` that a neighbour lacks. ``sent``: the life and the number
        of those that were sent to it."""
        if router not in self._declared:
            return None
        life, declarations = self._declared[router]
        first = sent[1] if sent[0] == life else 0
        return Part(router, life, first, declarations[first:]) if declarations[first:] else None

    def begins(self, router: int, life: int) -> None:
        """``router`` is now in that life; its declarations of an earlier life are void."""
        known_life, declarations = self._declared.get(router, (0, []))
        if known_life < life:
            self._lose(router, declarations)
            self._declared[router] = life, []

    def came_online(self, router: int) -> None:
        """There is a way to ``router``."""
        self._online[router] = None
        self._context.sees(self._own, router, HostState.ONLINE)
        self._gain(router, self._declared.get(router, (0, []))[1])

    def went_offline(self, router: int) -> None:
        """There is no way to ``router`` any more."""
        del self._online[router]
        self._context.sees(self._own, router, HostState.OFFLINE)
        self._lose(router, self._declared.get(router, (0, []))[1])

    def _gain(self, router: int, declarations: list[Declaration]) -> None:
        for _, topic in declarations:
            if not topic:
                continue
            listeners = self._listeners.setdefault(topic, [])
            if router not in listeners:
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
