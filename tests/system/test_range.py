"""A short radio: the fleet falls apart, its parts carry on alone, and all takes longer."""

from bisect import bisect_left

import numpy as np
import pytest
from runs import HELLO, MAZE_8, audited, built, call_often, finished

from desim.advice.warnings import warnings
from desim.monitor.summary import summarize
from desim.units import NS_PER_S

LAN = ("network.media.lan.rules.0.distance={}",)
AIR = ("deployment=field", "network.media={{lan: null, air: {{model: disk, range: {}}}}}")
ALONE_S = 25


def summary(seed, way, reach, *more):
    """Of a run to its end."""
    simulation = built(MAZE_8, *(override.format(reach) for override in way), *more, seed=seed)
    outcome = simulation.run()
    summed_up = summarize(simulation.monitor, outcome.simulated_ns)
    audited(simulation)
    return summed_up


@pytest.mark.parametrize("seed", [1, pytest.param(2, marks=pytest.mark.validation)])
def test_exploration_is_slower_within_15_m_than_within_200_m(seed):
    """On both seeds, so that the median of the paired differences is above zero whatever a third
    one gave. The slower run need not be seen to its end."""
    far = summary(seed, LAN, "200 m")
    near = summary(seed, LAN, "15 m", f"stop.elapsed={far['exploration_time_s']} s")
    assert far["partitions"]["count"] == 0
    assert near["partitions"]["count"] > 0
    assert 0 < near["partitions"]["longest_s"] <= near["partitions"]["total_s"]
    assert near["partitions"]["total_s"] <= near["simulated_s"] <= far["exploration_time_s"]
    assert near["exploration_time_s"] is None


def test_the_same_in_the_field():
    far = summary(1, AIR, "200 m")
    near = summary(1, AIR, "15 m", f"stop.elapsed={far['exploration_time_s']} s")
    assert near["partitions"]["count"] > 0 == far["partitions"]["count"]
    assert near["exploration_time_s"] is None


@pytest.mark.parametrize("way", [LAN, AIR], ids=["testbed", "field"])
def test_robots_carry_on_alone(way):
    """A robot that hears no map for a while goes on meanwhile, and what it knows grows, unless it
    is on its way through what it knows already (3 of 106 spells on seeds 1 to 5, either way)."""
    heard = {}

    def note(message, receiver, time_ns, reason, first_ns, last_ns):
        if reason is None and message.topic.startswith("/map_exchange/"):
            heard.setdefault(hosts[receiver], []).append(time_ns)

    simulation = built(MAZE_8, *(override.format("15 m") for override in way), on_fate=note)
    hosts = [host.name for host in simulation.graph.hosts]
    monitor, known = simulation.monitor, []
    call_often(simulation, lambda: known.append((
        simulation.kernel.now_ns, list(monitor.coverage.known),
        monitor.truth.travelled_m().copy())))
    finished(simulation)
    times_ns = [row[0] for row in known]
    spells = grown = 0
    for i, name in enumerate(monitor.truth.explorers):
        marks = [0, *heard.get(name, []), times_ns[-1]]
        for begin_ns, end_ns in zip(marks, marks[1:], strict=False):
            if end_ns - begin_ns < ALONE_S * NS_PER_S:
                continue
            # from just after the last map that came to just before the next one
            first = bisect_left(times_ns, begin_ns + NS_PER_S)
            last = bisect_left(times_ns, end_ns) - 1
            assert known[last][2][i] > known[first][2][i] + 1.0, (name, begin_ns, end_ns)
            spells += 1
            grown += known[last][1][i] > known[first][1][i]
    assert spells >= 4
    assert grown >= 0.8 * spells


def test_media_of_some_hosts_carry_what_is_theirs():
    """Two radios on robot_1, and no way from robot_0 to robot_2; no host relays."""
    simulation = built(HELLO, "deployment=field", "stop.elapsed=10 s", (
        "network.media={lan: null, left: {model: disk, hosts: [robot_0, robot_1]}, "
        "right: {model: disk, hosts: [robot_1, robot_2]}}"))
    simulation.run()
    graph = simulation.graph
    left, right = graph.media
    assert left.delivered > 0 < right.delivered
    assert (left.tx_bytes[2], left.rx_bytes[2], right.tx_bytes[0], right.rx_bytes[0]) == (0,) * 4
    assert graph.linked(np.arange(3)).tolist() == [
        [True, True, False], [True, True, True], [False, True, True]]
    assert {reason for topic in graph.topics.values() for reason in topic.counts.dropped} == {
        "no_route"}


def test_a_base_that_no_radio_can_reach_is_warned_of():
    """Over a radio a host without a place hears nobody. Its strategy would wait for ever."""
    def warned(*overrides):
        simulation = built(HELLO, "deployment=field", *overrides,
                           "hosts.base.strategy={strategy: nearest_frontier}", "stop.elapsed=6 s")
        simulation.run()
        return warnings(simulation.monitor)
    radio = "network.media.air={model: radio}"
    assert warned("hosts={base: {}}", radio) == [
        "host base has no place (hosts.base.at), and no message from or to it has arrived: nobody "
        "hears such a host over a radio"]
    assert warned("hosts={base: {at: [0 m, 0 m]}}", radio) == []
    assert warned("hosts={base: {}}", "network.media.air={model: disk, range: 5 m}") == []
