"""Robots over ROS 1 masters and a network that breaks: they go on, and every message has a fate."""

import pytest
from runs import HELLO, ROUGH, Tally, built, finished

from desim.monitor.summary import summarize

ROS1 = "middleware={model: desim.middleware.ros1.ros1:Ros1"
MULTI = "middleware={model: desim.middleware.multimaster.multimaster:Multimaster"
MIDDLEWARE = {
    "roscpp, master on the base": f"{ROS1}, master: base}}",
    "rospy, master on a robot": f"{ROS1}, client: rospy, master: b}}",
    "multimaster of groovy": f"{MULTI}, preset: fkie_1_3_groovy}}",
    "multimaster of noetic": f"{MULTI}, preset: fkie_1_3, leave: true}}",
}
CUT = ("network.media.lan={model: switch, rules: [{rule: partition, groups: [[robot_0, base]], "
       "from: 8 s, until: 20 s}]}")


@pytest.mark.parametrize("middleware", MIDDLEWARE.values(), ids=MIDDLEWARE)
def test_books_balance_when_everything_goes_wrong(middleware):
    tally = Tally()
    run = built(ROUGH, middleware, trace_sink=tally.sink, on_fate=tally.fate)
    finished(run)
    assert sum(tally.delivered.values()) > 30


@pytest.mark.parametrize("middleware", [f"{ROS1}, master: base}}", f"{MULTI}}}"],
                         ids=["ros1", "multimaster"])
def test_the_terrain_is_explored_though_the_base_is_lost_and_a_robot_cut_off(middleware):
    """Over the testbed's LAN: the base, which may have the master, restarts; a robot restarts."""
    run = built(HELLO, middleware, CUT, "hosts.base={}", "stop.elapsed=300 s",
                "faults=[{at: 5 s, host: base, down_for: 10 s}, "
                "{at: 12 s, host: robot_2, down_for: 5 s}]")
    outcome = finished(run)
    assert outcome.stop_reason == "explored"
    assert summarize(run.monitor, outcome.simulated_ns)["exploration_time_s"] < 300


def test_the_same_seed_gives_the_same_run():
    digests = {finished(built(ROUGH, f"{MULTI}}}")).digest for _ in range(2)}
    assert len(digests) == 1


def maps_over_the_air():
    """Maps that came from robot to robot, of three that begin in one instant to look for their
    master over the radio."""
    simulation = built(HELLO, "stop.elapsed=10 s", "deployment=field",
                       "middleware={model: ros1, master: base}", "hosts={base: {at: [0 m, 0 m]}}",
                       "network.media={air: {model: radio}}")
    simulation.run()
    return [simulation.graph.topics[f"/map_exchange/robot_{k}"].counts.delivered for k in range(3)]


def test_questions_that_collide_on_the_air_do_not_collide_for_ever(monkeypatch):
    """Linux repeats them each second by its own clock, and no two hosts' clocks tick as one."""
    assert maps_over_the_air() == [4, 4, 4]
    monkeypatch.setattr("desim.middleware.arp.MOST_UP_NS", 1)
    assert maps_over_the_air() == [0, 0, 0]
