"""Strategies hear of what happens, speak over the network, and may run without a body."""

import numpy as np
import pytest
import speaking
from runs import HELLO, built, finished

from desim.robot.mapping.tiles import FREE, OCCUPIED, raster
from desim.scenario.load import load

CHATTY = (HELLO, "coordination.strategy=speaking:Chatty", "stop.elapsed=40 s")


def log_of(*case):
    speaking.LOG.clear()
    outcome = finished(built(*case))
    return list(speaking.LOG), outcome


def test_goals_are_announced_over_the_network_and_their_ends_are_reported():
    log, _ = log_of(*CHATTY)
    starts = [entry for entry in log if entry[2] == "start"]
    assert starts == [(0.0, f"robot_{k}", "start", tuple(
        f"robot_{j}" for j in range(3) if j != k)) for k in range(3)]
    announced = {(host, source) for _, host, what, source, *_ in
            (entry for entry in log if entry[2] == "announced")}
    assert announced == {(f"robot_{a}", f"robot_{b}") for a in range(3) for b in range(3) if a != b}
    assert {entry[3] for entry in log if entry[2] == "ended"} == {"obsolete"}  # seen from afar
    assert all(kind is list for *_, kind in (entry for entry in log if entry[2] == "announced"))


def test_messages_of_strategies_are_messages_like_any_other():
    lossy = "network.media.air={model: ideal, rules: [{rule: loss, probability: 1}]}"
    log, _ = log_of(*CHATTY, "deployment=field", lossy)
    assert {entry[2] for entry in log} >= {"start", "ended"}
    assert not [entry for entry in log if entry[2] in ("announced", "hears")]


def test_a_teammate_that_stops_is_lost_and_comes_back():
    log, _ = log_of(*CHATTY, "coordination.lost_after=6 s",
                    "faults=[{at: 12 s, host: robot_2, down_for: 14 s}]", "stop.explored=100 %")
    team = [entry[2:] for entry in log
            if entry[1] == "robot_0" and entry[2] in ("hears", "lost") and entry[3] == "robot_2"]
    assert team == [("hears", "robot_2"), ("lost", "robot_2"), ("hears", "robot_2")]


@pytest.mark.parametrize("more", [(), ("network.media.lan={model: switch, rate: 1 Mb/s}",)])
def test_the_same_run_twice_is_the_same_to_the_last_bit(more):
    first, outcome = log_of(*CHATTY, *more)
    second, other = log_of(*CHATTY, *more)
    assert (first, outcome.digest) == (second, other.digest)


CENTRAL = (HELLO, "coordination.strategy=speaking:Central", "hosts.base={}",
           "hosts.base.strategy={strategy: 'speaking:Central'}")


def test_a_host_without_a_body_sends_the_robots():
    log, outcome = log_of(*CENTRAL)
    assert {entry[1] for entry in log if entry[2] == "sent"} == {"robot_0", "robot_1", "robot_2"}
    assert outcome.stop_reason == "explored"


def test_robots_go_on_alone_when_their_coordinator_is_gone():
    log, outcome = log_of(*CENTRAL, "faults=[{at: 10 s, host: base}]")
    assert min(entry[0] for entry in log if entry[2] == "alone") > 10
    assert outcome.stop_reason == "explored"


SURVEYING = (HELLO, "coordination.strategy=speaking:Surveying", "stop.explored=100 %",
             "coordination.exchange={content: full, encoding: raw}")


def test_areas_are_what_teammates_have_seen_as_far_as_their_maps_came():
    speaking.LOG.clear()
    simulation = built(*SURVEYING)
    simulation.run()
    _, host, _, areas = speaking.LOG[-1]
    assert sorted(areas) == [name for name in ("robot_0", "robot_1", "robot_2") if name != host]
    for name, (seen, sent_ns) in areas.items():
        own = raster(simulation.grid, simulation.monitor.maps[name].own.snapshot().cells())
        now = (own <= FREE) | (own >= OCCUPIED)
        # A robot's evidence of a cell may fall back; so much of it that nothing is left is rare.
        assert (seen & ~now).sum() <= 0.001 * seen.sum()
        assert 0.5 * now.sum() < seen.sum()
        assert simulation.kernel.now_ns - 30 * 10**9 < sent_ns < simulation.kernel.now_ns
        assert not seen.flags.writeable
    assert not speaking.LOG[0][3]  # nothing had come yet


def test_who_shares_no_map_has_no_area():
    log, _ = log_of(*SURVEYING[:2], "coordination.exchange=null", "stop.elapsed=20 s")
    assert log and not any(areas for *_, areas in log)


MINPOS = "coordination.strategy=desim.robot.coordination.strategies.minpos:MinPos"


def test_poses_and_goals_are_announced_where_the_strategy_reads_them():
    reads, is_off, nearest = (load(HELLO, case).scenario.coordination.team_state for case in (
        (MINPOS,), (MINPOS, "coordination.team_state=null"), ()))
    assert (reads.period_ns, reads.via, is_off, nearest) == (10**9, "unicast", None, None)


def test_a_team_state_brings_pose_and_goal():
    simulation = built(HELLO, MINPOS, "stop.elapsed=5 s")
    finished(simulation)
    counts = simulation.graph.topics["/robot_1/team_state"].counts
    # To two others once a second, from a phase drawn by name on.
    assert counts.delivered == counts.intended == 10
    assert counts.bytes == 10 * 2 * (72 + len("/p3dx0_tf/map"))


LISTENING = (HELLO, "coordination.strategy=speaking:Listening", "coordination.exchange=null",
             "deployment=field", "stop.elapsed=10 s")


def links_at_the_end(*case):
    speaking.LOG.clear()
    simulation = built(*LISTENING, *case)
    outcome = finished(simulation)
    return simulation, {host: what[1] for _, host, *what in speaking.LOG}, outcome


def test_links_have_the_time_and_where_the_radio_knows_it_the_power():
    radio = "network.media.air={model: radio, fidelity: mac}"
    simulation, links, _ = links_at_the_end(radio)
    assert {host: sorted(heard) for host, heard in links.items()} == {
        f"robot_{k}": [f"robot_{j}" for j in range(3) if j != k] for k in range(3)}
    # The robots stand 2 m apart, in one row.
    for (one, other), apart_m in {("robot_0", "robot_1"): 2.0, ("robot_0", "robot_2"): 4.0}.items():
        power_dbm = simulation.graph.media[0].model.signal(
            np.array([-10.0, 10.0]), np.array([[-10.0 + apart_m, 10.0]])).power_dbm[0]
        for heard in (links[one][other], links[other][one]):
            assert heard.signal_dbm == pytest.approx(power_dbm)
            assert 8 * 10**9 < heard.heard_ns <= 10 * 10**9


def test_a_disk_says_nothing_of_power_and_an_unheard_robot_has_no_link():
    _, links, _ = links_at_the_end("network.media.air={model: disk, range: 3 m}")
    assert {host: sorted(heard) for host, heard in links.items()} == {
        "robot_0": ["robot_1"], "robot_1": ["robot_0", "robot_2"], "robot_2": ["robot_1"]}
    assert {link.signal_dbm for heard in links.values() for link in heard.values()} == {None}


def test_of_a_robot_that_stopped_the_last_time_and_power_stay():
    radio = "network.media.air={model: radio, fidelity: mac}"
    _, whole, _ = links_at_the_end(radio)
    _, links, _ = links_at_the_end(radio, "faults=[{at: 5 s, host: robot_2}]")
    heard = links["robot_0"]["robot_2"]
    assert heard.heard_ns <= 5 * 10**9 + 10**8
    assert heard.signal_dbm == whole["robot_0"]["robot_2"].signal_dbm < 0.0


def test_who_is_heard_of_through_another_alone_has_no_power():
    _, links, _ = links_at_the_end(
        "network.media.air={model: radio, fidelity: walls, power: -24 dBm}",
        "coordination.exchange={model: relayed, period: 1 s}")
    assert {host: {name: link.signal_dbm is not None for name, link in heard.items()}
            for host, heard in links.items()} == {
        "robot_0": {"robot_1": True, "robot_2": False},
        "robot_1": {"robot_0": True, "robot_2": True},
        "robot_2": {"robot_0": False, "robot_1": True}}


def test_asking_for_links_changes_nothing_else(monkeypatch):
    radio = "network.media.air={model: radio, fidelity: mac}"
    _, _, asked = links_at_the_end(radio)
    monkeypatch.setattr(speaking.Listening, "on_second",
                        lambda self, context: context.publish("here", None))
    assert links_at_the_end(radio)[2].digest == asked.digest
