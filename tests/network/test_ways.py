"""Frames over several media, through hosts that pass them on."""

import pytest

from desim import ports
from desim.network.carrier import Carrier
from desim.network.medium import Medium
from desim.network.ways import Way
from desim.ports import FULL_PACKET_BYTES
from desim.testing import Bench
from netmodels.access_link import AccessLink
from netmodels.ideal import Ideal

MS = 10**6


class First:
    """Loses the first packet of each train."""

    reasons = ("first",)

    def start(self, context, hosts):
        pass

    def judge(self, frame, receivers):
        return [ports.Drop("first", (0,)) if frame.segments > 1 else ports.Drop("first")
                ] * len(receivers)


class Twice:
    """Makes a copy of each frame."""

    reasons = ()

    def start(self, context, hosts):
        pass

    def judge(self, frame, receivers):
        return [ports.Duplicate(MS)] * len(receivers)


class Fates(Carrier):
    def __init__(self, kernel):
        self.kernel, self.all = kernel, []

    def note(self, receiver, fate):
        self.all.append((self.kernel.now_ns // MS, receiver, fate))

    def arrived(self, token, receiver):
        self.note(receiver, "arrived")

    def arrived_in_part(self, token, receiver, lost):
        self.note(receiver, lost)

    def lost(self, token, receiver, reason):
        self.note(receiver, reason)

    def repeated(self, token, receiver):
        self.note(receiver, "repeated")


def sent(first=(), second=(), size_bytes=3 * FULL_PACKET_BYTES, segments=3):
    """The fates of a train of host_1 that host_2 passes on to host_3, its forwardings, and both
    media: 10 Mb/s, where a full packet takes 1.2 ms, and 5 ms whatever the size."""
    bench = Bench(AccessLink(AccessLink.Params(rate="10 Mb/s")), 3, rules=first)
    media = bench.medium, Medium(
        "other", Ideal(Ideal.Params(delay="5 ms")), second, kernel=bench.kernel,
        names=bench.names, streams=None, hosts=bench.hosts)
    fates, forwarded = Fates(bench.kernel), []
    way = Way(lambda source, receiver: ((media[0], 1), (media[1], 2)),
              lambda *what: forwarded.append((bench.kernel.now_ns // MS, *what)), 7)
    assert way.transmit(0, (2,), size_bytes, segments, False, fates, "token") is None
    bench.run()
    return fates.all, forwarded, media


def test_a_frame_is_stored_and_forwarded():
    fates, forwarded, media = sent()
    assert fates == [(8, 2, "arrived")]
    assert forwarded == [(3, 1, 0, 2, 4554)]
    assert [medium.tx_bytes for medium in media] == [[4554, 0, 0], [0, 4554, 0]]


def test_packets_that_one_leg_loses_do_not_go_over_the_next():
    fates, forwarded, media = sent([First()], [First()])
    assert fates == [(7, 2, {0: "first", 1: "first"})]
    assert forwarded == [(2, 1, 0, 2, 3036)]
    assert [medium.packets_delivered for medium in media] == [2, 1]


@pytest.mark.parametrize("leg", [0, 1])
def test_a_loss_on_any_leg_is_one_at_the_receiver(leg):
    rules = [[First()], []]
    fates, forwarded, _ = sent(rules[leg], rules[1 - leg], 1250, 1)
    assert fates == [(leg, 2, "first")]
    assert len(forwarded) == leg


def test_copies_on_the_way_end_at_the_host_that_passes_frames_on():
    assert sent([Twice()])[0] == [(8, 2, "arrived")]
    assert sent([], [Twice()])[0] == [(8, 2, "arrived"), (9, 2, "repeated")]
