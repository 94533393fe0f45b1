"""DDS where one end has given the other one up and that one has not.

Leases differ, and an outage between the two makes differ what they remember.
"""

import pytest
from configured import configured
from graphs import MS, Net, S, listener, silent, talker

from desim.middleware.dds.dds import Dds
from desim.middleware.dds.endpoints import Endpoints
from desim.ports import Drop
from netmodels.access_link import AccessLink
from netmodels.rules.partition import Partition

PRESETS = ("fastdds", "cyclonedds")
SAYS = [(k * S, str(k)) for k in range(1, 200)]


class LosesOne:
    """Loses the frame of this number of those that ``a`` sends after 30 s."""

    reasons = ("unlucky",)

    def __init__(self, number):
        self._left = number

    def start(self, context, hosts):
        self._context, self._source = context, hosts.index("a")

    def judge(self, frame, receivers):
        if frame.source == self._source and self._context.now_ns >= 30 * S:
            self._left -= 1
            if not self._left:
                return [Drop("unlucky")] * len(receivers)
        return None


def dds(preset, **params):
    return Dds(configured(Dds.Params, preset=preset, announcement_period="3 s", **params))


def cut(host, begin, end):
    return Partition(Partition.Params(groups=[[host]], **{"from": begin, "until": end}))


def last_heard(heard):
    return max(int(row[-1]) for row in heard)


def one_forgets(preset, lost_frame):
    """``b``'s lease is short: ``a`` forgets it in the outage, but not the other way round. Returns
    the last number that ``a`` has heard of 199."""
    heard = []
    net = Net({"a": listener(heard), "b": talker(SAYS)},
              AccessLink(AccessLink.Params(rate="10 Mb/s", latency="2 ms")),
              [cut("b", "20 s", "30 s"), LosesOne(lost_frame)],
              middleware=dds(preset, leases={"b": "6 s", "a": "30 s"}))
    net.run(200 * S)
    return last_heard(heard)


@pytest.mark.parametrize("preset", PRESETS)
def test_one_lost_frame_delays_and_does_not_end_what_was_taken_up_again(preset):
    assert [one_forgets(preset, number) for number in range(1, 9)] == [199] * 8


@pytest.mark.parametrize("preset", PRESETS)
def test_the_twin_that_offers_only_once_stays_deaf(preset, monkeypatch):
    before = Endpoints.acknack

    def acknowledged(self, remote, lost, series, got, missing, asks):
        beat_ns, beats = self._beat_ns, self._beats
        before(self, remote, lost, series, got, missing, asks)
        if asks and self._beat_ns != beat_ns:
            self._beat_ns, self._beats = beat_ns, beats

    monkeypatch.setattr(Endpoints, "acknack", acknowledged)
    assert min(one_forgets(preset, number) for number in range(1, 9)) < 30


def behind_a_server(preset, back_s=24, until_s=200):
    """The server forgets ``c`` in the outage, in which ``d`` restarts; ``c`` keeps the server.
    Returns the last number that ``c`` has heard of ``d``, and the run."""
    heard = []
    net = Net({"server": silent, "c": listener(heard), "d": talker(SAYS)},
              AccessLink(AccessLink.Params(rate="10 Mb/s", latency="2 ms")),
              [cut("c", "20 s", "35 s")],
              middleware=dds(preset, discovery="server", server="server",
                             leases={"c": "6 s", "d": "6 s", "server": "60 s"}))
    net.at(21 * S, net.graph.host("d").stop)
    if back_s is not None:
        net.at(back_s * S, net.graph.host("d").start)
    net.run(until_s * S + MS)
    return last_heard(heard), net


@pytest.mark.parametrize("preset", PRESETS)
def test_a_server_that_has_forgotten_a_client_tells_it_all_anew(preset):
    assert behind_a_server(preset)[0] == 199


@pytest.mark.parametrize("preset", PRESETS)
def test_who_died_meanwhile_is_forgotten_after_the_servers_lease(preset):
    heard, net = behind_a_server(preset, back_s=None)
    assert heard == 19
    assert net.graph.context.beliefs.ghosts == 0
    me = net.graph.middleware.participants[0]
    assert [net.graph.hosts[guid[0]].name for guid in me.remotes] == ["server"]


def test_the_twin_that_goes_on_counting_leaves_the_client_deaf(monkeypatch):
    """The cut ends at 35 s; the other one hears d again at 37 s. (The twin's server and client say
    thousands of heartbeats a second, so this ends soon.)"""
    assert behind_a_server("fastdds", back_s=34, until_s=38)[0] == 37
    monkeypatch.setattr(Endpoints, "_goes_on", lambda self, remote, series: True)
    assert behind_a_server("fastdds", back_s=34, until_s=38)[0] == 19
