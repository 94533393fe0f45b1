"""The kit for middlewares that take time: it takes right ones, and names what is wrong with others.
Each broken one is a right one with one thing wrong."""

from __future__ import annotations

import random

import pytest
from toy_middlewares import Late, Naive

from desim.middleware.datagrams import Datagram
from desim.middleware.direct import Direct
from desim.middleware.transports import Stream, StreamLink
from desim.testing import Patience, check_discovery

S = 10**9
SHORT = Patience(find_ns=4 * S, again_ns=70 * S, down_ns=5 * S, apart_ns=10 * S)


@pytest.mark.parametrize("cls", [Direct, Late, Naive])
def test_right_ones_pass(cls):
    check_discovery(cls, SHORT)


@pytest.mark.parametrize("stops", [(0,), (1, 3)])
def test_any_host_may_stop(stops):
    check_discovery(Late, SHORT._replace(stops=stops))


def carried(context, offer, stream):
    host = context._graph.hosts[offer.publisher.host]
    return stream(host, offer.queue) if offer.transport == "stream" else Datagram(host, False)


class Slow(Late):
    """Takes longer than it says."""

    delay_ns = 10 * S


class Deaf(Late):
    """One host is never told of another."""

    def learn(self, arg):
        if arg[:2] != (3, 0):
            super().learn(arg)


class Loud(Direct):
    """Sends everything to everybody."""

    def subscribers(self, publisher):
        known = super().subscribers(publisher)
        others = {end.host for ends in self._subscribers.values() for end in ends}
        return (*known, *(publisher._replace(host=host) for host in sorted(others)))


class Twice(Direct):
    """Its streams deliver what they have delivered."""

    def start(self, context):
        super().start(context)
        self.context = context

    def transport(self, offer):
        class Echo(Stream):
            def send(self, message, only=None):
                super().send(message, only)
                super().send(message, only)

        return carried(self.context, offer, Echo)


class Forgetful(Twice):
    """Some messages have no fate."""

    def transport(self, offer):
        class Sieve(Stream):
            def send(self, message, only=None):
                if message.seq % 7:
                    super().send(message, only)

        return carried(self.context, offer, Sieve)


class Undying(Naive):
    """Messages come to hosts that have stopped."""

    def transport(self, offer):
        graph = self.context._graph

        class Insistent(Stream):
            def send(self, message, only=None):
                for receiver in list(self._links):
                    if graph.up[receiver]:
                        super().send(message, [receiver])
                    else:
                        graph.on_fate(message, receiver, message.born_ns, None, 0, 0)

        return carried(self.context, offer, Insistent)


class Final(Late):
    """A host that has been away once is told nothing any more."""

    def learn(self, arg):
        if self.life[arg[0]] < 2:
            super().learn(arg)


class Sulking(Twice):
    """A stream that lost a frame sends nothing any more."""

    def transport(self, offer):
        class Silent(StreamLink):
            __slots__ = ()

            def _wait(self, message, until_ns):
                """It does not come back to it."""

        class Stuck(Stream):
            def send(self, message, only=None):
                for link in self._links.values():
                    link.__class__ = Silent
                super().send(message, only)

        return carried(self.context, offer, Stuck)


class Dreaming(Late):
    """It reports other beliefs of hosts than those that they act on."""

    def announce(self, host, end, holds):
        if host == 2:
            self.context.changed(end.topic)
        else:
            super().announce(host, end, holds)


class Restless(Late):
    """Looks around a thousand times a second."""

    pause_ns = S // 1000

    def switched(self, host, up):
        super().switched(host, up)
        if up:
            self.poll((host, self.life[host]))

    def poll(self, arg):
        host, life = arg
        if life == self.life[host]:
            self.context.at(self.context.now_ns + self.pause_ns, host, self.poll, arg)


class Undead(Restless):
    """Its timers outlive their host."""

    pause_ns = S // 5

    def poll(self, arg):
        self.context.at(self.context.now_ns + self.pause_ns, arg[0], self.poll, arg)


class Accumulating(Restless):
    """Every change anywhere starts one more timer."""

    pause_ns = S // 5

    def learn(self, arg):
        super().learn(arg)
        if self.context.now_ns > 20 * S and self.context.up(arg[0]):
            self.poll((arg[0], self.life[arg[0]]))


class Remembering(Late):
    """One run changes the next."""

    def start(self, context):
        super().start(context)
        Remembering.delay_ns += 1


class Gambler(Late):
    """Draws its own luck."""

    def later(self, host, fn, arg):
        self.context.at(self.context.now_ns + random.randrange(S), host, fn, arg)


class Unsourced(Direct):
    class Params(Direct.Params):
        period: int = 3


@pytest.mark.parametrize(("cls", "says"), [
    (Slow, "bring subscribers and publishers together: 4 s after the start"),
    (Deaf, "bring subscribers and publishers together: 4 s after the start host_1 has not heard"),
    (Loud, "was sent to host_2, which does not listen"),
    (Twice, "has two fates at"),
    (Forgetful, "neither delivered nor dropped, and 0 wait"),
    (Undying, "which does not run"),
    (Final, "70 s after host_2 was started again"),
    (Sulking, "70 s after host"),
    (Dreaming, "say by context.knows what hosts believe"),
    (Restless, "let timers rest"),
    (Undead, "do nothing when no host runs"),
    (Accumulating, "come to rest after outages"),
    (Remembering, "the same trace for the same seed"),
    (Gambler, "not from random"),
    (Unsourced, "where the default of parameter 'period' comes from"),
])
def test_the_kit_names_what_is_wrong(cls, says):
    with pytest.raises(AssertionError, match=says):
        check_discovery(cls, SHORT)
