"""Small middlewares that take time, to test with."""

from __future__ import annotations

from desim.ports import Params


class Late:
    """Everybody knows everything ``delay_ns`` after it happened, a stop included, without a frame.
    Publishers have to learn of subscribers. What a host once knew it forgets when it stops, and is
    told again ``delay_ns`` after it starts."""

    informed = "publisher"
    delay_ns = 2 * 10**9

    class Params(Params):
        """``Late`` has no parameters."""

    def __init__(self, params=None):
        pass

    def start(self, context):
        self.context = context
        self.ends = [[] for _ in context.hosts]  # of each host, its subscriptions
        self.known = [{} for _ in context.hosts]  # to each host, subscriptions of others
        self.topics = [[] for _ in context.hosts]  # what it publishes
        self.life = [0] * len(context.hosts)

    def switched(self, host, up):
        self.life[host] += 1
        self.ends[host], self.topics[host], self.known[host] = [], [], {}
        for other in range(len(self.ends)):
            if other != host:
                if up:
                    self.later(host, self.learn, (host, other, self.life[host]))
                self.later(other, self.learn, (other, host, self.life[other]))

    def advertise(self, offer):
        self.topics[offer.publisher.host].append(offer.publisher.topic)

    def subscribe(self, subscriber):
        host = subscriber.host
        self.ends[host].append(subscriber)
        self.known[host][subscriber] = None
        self.context.changed(subscriber.topic)
        for other in range(len(self.ends)):
            if other != host:
                self.later(other, self.learn, (other, host, self.life[other]))

    def later(self, host, fn, arg):
        self.context.at(self.context.now_ns + self.delay_ns, host, fn, arg)

    def learn(self, arg):
        host, other, life = arg
        if not self.context.up(host) or life != self.life[host]:
            return
        known = self.known[host]
        before = [end for end in known if end.host == other]
        self.context.sees(host, other, "online" if self.context.up(other) else "offline")
        for end in before:
            if end not in self.ends[other]:
                del known[end]
                self.announce(host, end, False)
        for end in self.ends[other]:
            if end not in known:
                known[end] = None
                self.announce(host, end, True)

    def announce(self, host, end, holds):
        if end.topic in self.topics[host]:
            self.context.knows(host, end.host, end.topic, holds)
        self.context.changed(end.topic)

    def subscribers(self, publisher):
        return tuple(sorted(end for end in self.known[publisher.host]
                            if end.topic == publisher.topic))


class Naive(Late):
    """Learns, and never notices that somebody is gone."""

    delay_ns = 10**9

    def learn(self, arg):
        if self.context.up(arg[1]):
            super().learn(arg)
