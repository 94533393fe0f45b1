"""No robot reads the truth or another robot's state.

All that it knows came from its sensors and in messages.

The first run records what all sensors read. In the second one the same sensors play that back, to
the last bit, in a world in which nothing else is true: true poses, ways and velocities are NaN
after the start (which a robot's launch file has), walls are gone, the ground is upside down, and
commands move nobody. A robot that looked at the truth anywhere, by whatever path of attributes or
closures, would see garbage there. So its rows in the trace (goals, recoveries, processed scans,
messages sent and received, with their sizes) would change; they do not. All contents are computed
at their birth, so that reading a message later asks no world.

Shifting or turning the world would show less: robots' numbers would change with the frame, by
rounding at least. The architecture test forbids imports; it sees neither closures nor objects that
are handed over.

That no robot reads another's state is shown likewise: a robot whose sensors play back a record, and
that hears nobody, does the same whether the others run their software or carry none.

A strategy that looks at the true poses, or that shares a memory with others, fails.
"""

import puppets
import pytest
from runs import HELLO, built

# Written by the monitor and the world, about robots.
OF_THE_TRUTH = {"pose", "collision", "sample", "sample_traffic", "sample_motion", "partition",
                "stop"}
FLEET = ("fleet.size=3", "stop.elapsed=18 s", "stop.explored=100 %", "stop.by=all")


def deeds(world, *case):
    """The digests of what robots did, by kind of row and robot."""
    simulation = built(HELLO, f"physics.model=puppets:{world}", *FLEET, *case, payloads="birth")
    assert simulation.run().simulated_ns == 18 * 10**9
    kinds, robots = simulation.names, simulation.world.robots
    return {(kinds[kind], kinds[entity]): digest
            for (kind, entity), digest in simulation.trace.digests().items()
            if kinds[entity] in robots and kinds[kind] not in OF_THE_TRUTH}


def played_twice(*case):
    """The deeds of robots with the truth, and with none."""
    puppets.READ.clear()
    with_truth = deeds("Recorded", *case)
    assert {"goal", "sent"} <= {kind for kind, _ in with_truth}
    return with_truth, deeds("Scrambled", *case)


@pytest.mark.parametrize("case", [
    ("robot.localization=odometry",),
    ("robot.localization=scan_matching", "robot.odometry.model=random_walk"),
    ("robot.localization={model: gmapping, particles: 3}",),
    ("robot.localization=odometry", "coordination.strategy=market"),
    ("robot.localization=scan_matching", "coordination.strategy=minpos",
     "coordination.exchange={model: scans}"),
], ids=lambda case: " ".join(one.rpartition("=")[2] for one in case))
def test_robots_do_the_same_without_a_truth(case):
    with_truth, without = played_twice(*case)
    assert with_truth == without


def test_who_reads_the_truth_is_found():
    with_truth, without = played_twice("robot.localization=odometry",
                                     "coordination.strategy=puppets:Peeping")
    assert with_truth != without


def test_the_signal_of_a_teammate_is_that_of_its_last_message():
    """From 6 s on nothing gets through. True places, which a radio's signals are computed from,
    are hidden only then."""
    radio = "{model: radio, fidelity: mac, rules: [{rule: 'puppets:silence'}]}"
    case = ("robot.localization=odometry", "coordination.strategy=puppets:Tuning",
            "deployment=field", f"network.media.air={radio}")
    puppets.READ.clear()
    puppets.SIGNALS.clear()
    with_truth, before = deeds("RecordedPlaces", *case), puppets.SIGNALS.copy()
    assert any(signals for now_ns, _, signals in before if now_ns > puppets.SILENT_FROM_NS)
    puppets.SIGNALS.clear()
    assert deeds("ScrambledLater", *case) == with_truth
    assert before == puppets.SIGNALS


def test_robots_with_a_sensor_of_the_truth_get_nowhere():
    with pytest.raises(ValueError, match="cannot convert float NaN to integer"):
        played_twice("robot.localization=ground_truth")


ALONE = ("deployment=field", "network.media.air={model: ideal}", "coordination.exchange=null",
         "robot.localization=odometry")


def of_the_first(*case):
    """The deeds of robot_0 among robots with software, and among bodies."""
    puppets.READ.clear()
    deeds("Recorded", *ALONE, *case)
    among, alone = (deeds("Scrambled", *ALONE, *case, *more)
                    for more in ((), ("robot.passive=[robot_1, robot_2]",)))
    return [{kind: digest for (kind, robot), digest in done.items() if robot == "robot_0"}
            for done in (among, alone)]


def test_a_robot_that_hears_nobody_does_as_if_nobody_else_ran():
    among, alone = of_the_first()
    assert "goal" in among
    assert among == alone


def test_who_shares_a_memory_is_found():
    among, alone = of_the_first("coordination.strategy=puppets:Telepathic")
    assert among != alone
