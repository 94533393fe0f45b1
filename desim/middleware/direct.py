"""A registry that all hosts know at once: no master, no discovery, no traffic."""

from __future__ import annotations

from bisect import insort

from desim import ports
from desim.ports.middleware import Endpoint, MiddlewareContext, Offer


class Direct:
    """Each host knows all subscribers in the same instant."""

    class Params(ports.Params):
        """``direct`` has no parameters."""

    def __init__(self, params: Params | None = None) -> None:
        self._subscribers: dict[str, list[Endpoint]] = {}

    def start(self, context: MiddlewareContext) -> None:
        self._changed = context.changed

    def advertise(self, offer: Offer) -> None:
        """Publishers need not be known: they ask for their subscribers."""

    def subscribe(self, subscriber: Endpoint) -> None:
        known = self._subscribers.setdefault(subscriber.topic, [])
        if subscriber not in known:
            insort(known, subscriber)
            self._changed(subscriber.topic)

    def switched(self, host: int, up: bool) -> None:
        for topic, known in self._subscribers.items():
            left = [end for end in known if end.host != host]
            if len(left) < len(known):
                self._subscribers[topic] = left
                self._changed(topic)

    def subscribers(self, publisher: Endpoint) -> tuple[Endpoint, ...]:
        return tuple(self._subscribers.get(publisher.topic, ()))
