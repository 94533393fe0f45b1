"""A bumper: contacts are told to the robot's software, which backs off from what it cannot see."""

import numpy as np
from runs import SCENARIOS, built, call_often

BLIND = "fleet.types.mapper.robot.lasers.low.height=0.6 m"  # to the low wall at x = -2 m
ALONE = "fleet.robots=[{type: mapper, count: 1}]"
POSES = "fleet.start={poses: [{x: -8 m, y: -4 m}]}"


def driven(*overrides):
    """The mapper's contacts and messages of its bumper, and the samples, ten a second, in which it
    is told to drive forward and does not move."""
    simulation = built(SCENARIOS / "two_types.yaml", ALONE, POSES, BLIND, "stop.elapsed=60 s",
                       *overrides)
    world, samples = simulation.world, []
    call_often(simulation, lambda: samples.append((world._bodies._arrays.commands[0, 0],
                                                   world.velocities[0, 0])))
    simulation.run()
    simulation.graph.catch_up()
    topic = simulation.graph.topics.get("/robot_0/bumper")
    wanted, driven_mps = np.array(samples).T
    return (simulation.monitor.incidents.collisions, topic.counts.intended if topic else None,
            int(((wanted > 0.1) & (driven_mps < 0.01)).sum()))


def test_a_robot_backs_off_from_what_it_touches():
    contacts, notified, against = driven("robot.bumper=true")
    assert contacts == notified > 0
    assert against == 0
    without = driven()
    assert without[1] is None
    assert without[2] > 50  # the twin: it pushes for seconds
