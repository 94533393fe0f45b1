"""The registry that everybody knows at once: no master, no discovery, no traffic."""

from __future__ import annotations

from bisect import insort
from collections.abc import Callable

from desim.ports import Endpoint, Params


class Direct:
    """Who subscribes is known everywhere in the same instant."""

    class Params(Params):
        """``direct`` has no parameters."""

    def __init__(self, params: Params | None = None) -> None:
        self._subscribers: dict[str, list[Endpoint]] = {}

    def start(self, changed: Callable[[str], None]) -> None:
        self._changed = changed

    def advertise(self, publisher: Endpoint) -> None:
        """Publishers need not be known: they ask."""

    def subscribe(self, subscriber: Endpoint) -> None:
        known = self._subscribers.setdefault(subscriber.topic, [])
        if subscriber not in known:
            insort(known, subscriber)
            self._changed(subscriber.topic)

    def forget(self, host: int) -> None:
        for topic, known in self._subscribers.items():
            left = [end for end in known if end.host != host]
            if len(left) < len(known):
                self._subscribers[topic] = left
                self._changed(topic)

    def subscribers(self, publisher: Endpoint) -> tuple[Endpoint, ...]:
        return tuple(self._subscribers.get(publisher.topic, ()))
