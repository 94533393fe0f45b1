"""A registry that all hosts know at once: no master, no discovery, no traffic."""

from __future__ import annotations

from bisect import bisect_left

from desim import ports
from desim.ports.middleware import Advertisement, Endpoint, MiddlewareContext


class Direct:
    """Each host knows all subscribers in the same instant."""

    class Params(ports.Params):
        """``direct`` has no parameters."""

    def __init__(self, params: Params | None = None) -> None:
        self._subscribers: dict[str, list[Endpoint]] = {}
        # By host the topics that it subscribes to, with the number of each in ``_subscribers``:
        # a fleet in which everybody hears everybody has as many topics as hosts.
        self._topics: dict[int, dict[str, int]] = {}
        self._numbers: dict[str, int] = {}

    def start(self, context: MiddlewareContext) -> None:
        self._changed = context.changed

    def advertise(self, advertised: Advertisement) -> None:
        """Publishers need not be known: they ask for their subscribers."""

    def subscribe(self, subscriber: Endpoint) -> None:
        topic = subscriber.topic
        known = self._subscribers.setdefault(topic, [])
        place = bisect_left(known, subscriber)
        if known[place:place + 1] != [subscriber]:
            known.insert(place, subscriber)
            number = self._numbers.setdefault(topic, len(self._numbers))
            self._topics.setdefault(subscriber.host, {})[topic] = number
            self._changed(topic)

    def switched(self, host: int, up: bool) -> None:
        topics = self._topics.pop(host, {})
        for topic in sorted(topics, key=topics.__getitem__):
            self._subscribers[topic] = [end for end in self._subscribers[topic]
                                        if end.host != host]
            self._changed(topic)

    def subscribers(self, publisher: Endpoint) -> tuple[Endpoint, ...]:
        return tuple(self._subscribers.get(publisher.topic, ()))
