"""Media that have a channel in common share the air; each keeps its own account."""

from collections import Counter

import numpy as np
import pytest
from stations import UDP_BYTES as UDP
from stations import Flow

from desim.engine.kernel import Kernel, Phase
from desim.engine.streams import Streams
from desim.engine.trace import Names
from desim.errors import InputError
from desim.network.carrier import Carrier
from desim.network.medium import Medium
from desim.network.surroundings import Still
from netmodels.radio.dcf.radio import DcfRadio
from netmodels.radio.standards import G
from netmodels.rules.loss import Loss

FIXED = {"path_loss": {"model": "fixed", "total": "60 dB"}}
HOSTS = list("abcd")


class Run(Carrier):
    """Media of radios between the same hosts, in one run; what became of their frames."""

    def __init__(self, *media, places=None, rules=((), (), ())):
        self.kernel, names, self.log = Kernel(), Names(), []
        place = places and Still(np.array(places, float))
        self.media = [Medium(f"wifi_{k}", DcfRadio(DcfRadio.Params(**FIXED | params)), rules[k],
                             kernel=self.kernel, names=names, streams=Streams(1), hosts=HOSTS,
                             place=place) for k, params in enumerate(media)]

    def send(self, time_ns, medium, source, receivers, size_bytes=UDP):
        broadcast = len(receivers) > 1
        token = medium, source
        self.kernel.at(time_ns, Phase.CONTROL, medium, lambda _: self.media[medium].transmit(
            HOSTS.index(source), tuple(map(HOSTS.index, receivers)), size_bytes, 1, broadcast,
            self, token))

    def run(self, until_ns=10**9):
        self.kernel.run(until_ns)
        return self.log

    def arrived(self, token, receiver):
        self.log.append((self.kernel.now_ns, *token, HOSTS[receiver], "arrived"))

    def lost(self, token, receiver, reason):
        self.log.append((self.kernel.now_ns, *token, HOSTS[receiver], reason))

    def missed(self, token, receivers, reason, medium):
        for receiver in receivers:
            self.lost(token, receiver, reason)


def goodput(media, *flows):
    """Packets in a second of each flow (medium, source, destination)."""
    run = Run(*media)
    running = [Flow(run.media[medium], source, dest) for medium, source, dest in flows]
    run.run()
    return [flow.received for flow in running]


def test_two_media_on_one_channel_carry_as_much_as_one():
    together = sum(goodput([{}], (0, 0, 1), (0, 2, 3)))
    shared = goodput([{}, {}], (0, 0, 1), (1, 2, 3))
    assert sum(shared) == pytest.approx(together, rel=0.02)
    assert shared[0] == pytest.approx(shared[1], rel=0.1)


def test_the_twin_on_another_channel_has_the_air_to_itself():
    (alone,) = goodput([{}], (0, 0, 1))
    assert goodput([{}, {"channel": 6}], (0, 0, 1), (1, 2, 3)) == pytest.approx([alone, alone],
                                                                              rel=0.02)


@pytest.mark.parametrize(("channel", "fate"), [(1, "collision"), (6, "arrived")])
def test_frames_of_two_media_collide(channel, fate):
    run = Run({}, {"channel": channel})
    run.send(0, 0, "a", "bc")
    run.send(0, 1, "d", "bc")
    assert Counter(run.run()) == {
        (G.airtime_ns(1064, G.rate(6)), medium, source, receiver, fate): 1
        for medium, source in ((0, "a"), (1, "d")) for receiver in "bc"}


@pytest.mark.parametrize(("channel", "waits"), [(1, True), (6, False)])
def test_a_host_with_two_radios_hears_itself(channel, waits):
    """The second one begins when the first one's frame is over, DIFS and a backoff later."""
    run = Run({}, {"channel": channel})
    run.send(0, 0, "a", "bc")
    run.send(100_000, 1, "a", "bc")
    air_ns = G.airtime_ns(1064, G.rate(6))
    times = sorted({time_ns for time_ns, *_ in run.run()})
    assert times[0] == air_ns
    slots = (times[1] - 2 * air_ns - G.difs_ns) / G.slot_ns
    assert slots in range(16) if waits else times[1] == 100_000 + air_ns


def test_a_frame_is_for_the_hosts_of_its_medium_and_counted_there():
    run = Run({}, {}, {"channel": 11})
    run.send(0, 0, "a", "bcd")
    run.send(10**8, 1, "b", "acd")
    run.send(2 * 10**8, 1, "b", "a")
    run.run()
    assert [(medium.intended, medium.delivered) for medium in run.media] == [(3, 3), (4, 4), (0, 0)]
    assert [medium.model.attempts() for medium in run.media] == [(1, 0), (2, 0), (0, 0)]
    assert all(medium.in_flight() == 0 for medium in run.media)
    first, second, other = (medium.model.busy_ns(range(4)) for medium in run.media)
    assert first[2] == second[3] > 0 and other == [0, 0, 0, 0]


def test_a_medium_on_two_channels_joins_those_on_either():
    """Host d of the third medium is on channel 6."""
    run = Run({}, {"channel": 6}, {"channels": {"d": 6}})
    airs = {id(medium.model.air) for medium in run.media}
    assert len(airs) == 1
    run.send(0, 0, "a", "bc")
    run.send(0, 1, "b", "ac")
    run.send(0, 2, "d", "ab")
    fates = Counter((medium, fate) for _, medium, _, _, fate in run.run())
    assert fates == {(0, "arrived"): 2, (1, "collision"): 2, (2, "out_of_reach"): 2}


def test_places_count_as_within_one_medium():
    """c is too far from a to be found, and d is not."""
    run = Run({"path_loss": {}}, {"path_loss": {}}, places=[(0, 0), (5, 0), (500, 0), (30, 0)])
    run.send(0, 0, "a", "bcd")
    run.send(10**8, 1, "a", "bcd")
    fates = [(medium, receiver, fate) for _, medium, _, receiver, fate in run.run()]
    assert sorted(fates) == [
        (medium, receiver, "out_of_reach" if receiver == "c" else "arrived")
        for medium in (0, 1) for receiver in "bcd"]


def test_a_rule_is_asked_about_its_own_medium_alone():
    run = Run({}, {}, rules=((), [Loss(Loss.Params(probability=1))]))
    for medium, source in (0, "a"), (1, "b"), (0, "c"):
        run.send(medium * 10**8, medium, source, "ad" if source == "b" else "bd")
    run.send(2 * 10**8, 0, "a", "b")
    run.send(3 * 10**8, 1, "a", "b")
    fates = Counter((medium, source, fate) for _, medium, source, _, fate in run.run())
    assert fates == {(0, "a", "collision"): 2, (0, "c", "collision"): 2, (1, "b", "random_loss"): 2,
                     (0, "a", "arrived"): 1, (1, "a", "retry_limit"): 1}


@pytest.mark.parametrize(("params", "says"), [
    ({"power": "10 dBm"}, r"\.power: another radio shares its channel, and has another value "),
    ({"standard": "11b", "rate": "11 Mb/s"}, r"\.standard: another radio shares its channel"),
    ({"channel": 3}, r"\.channel: 3 overlaps channel 1 of another medium")])
def test_radios_that_cannot_share_the_air(params, says):
    with pytest.raises(InputError, match=says):
        Run({}, params)
    Run({}, params | {"channel": 11})


def test_what_may_differ():
    Run({}, {"rate": "6 Mb/s", "broadcast_rate": "6 Mb/s", "rts": "500 B"})
    Run({}, {"standard": "11a", "rate": "54 Mb/s", "path_loss": {}})  # another band
    with pytest.raises(InputError, match=r"\.rate: another radio"):
        Run({"rate_control": {}}, {"rate_control": {}, "rate": "6 Mb/s"})
