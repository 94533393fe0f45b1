"""A run with batches is the same as one with a message and an event for each."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from runs import HELLO, MAZE_8, built, finished
from test_conservation import CASES

from desim.middleware.batches.batch import Member
from desim.middleware.batches.publisher import BatchPublisher
from desim.middleware.topics import Topic
from netmodels.switch import Switch

LAN = "network.media.lan"
MORE = {
    "a fleet, frames that wait for the port": (MAZE_8, "stop.elapsed=5 s"),
    "flows in turn": (MAZE_8, "stop.elapsed=5 s", f"{LAN}.queue=fq_codel", f"{LAN}.rate=20 Mb/s"),
    "a port that is full": (MAZE_8, "stop.elapsed=5 s", f"{LAN}.rate=6 Mb/s",
                            f"{LAN}.buffer=2 kB"),
    "a port that loses some": (MAZE_8, "stop.elapsed=10 s", f"{LAN}.queue=fq_codel",
                               f"{LAN}.rate=7 Mb/s", f"{LAN}.buffer=20 kB"),
    "hosts that stop and start": (
        MAZE_8, "stop.elapsed=6 s",
        "faults=[{at: 1003 ms, host: robot_3, down_for: 700 ms}, "
        "{at: 2400 ms, host: workstation, down_for: 10 ms}, {at: 3 s, host: robot_1}]"),
    "hosts that stop in an instant of scans": (
        MAZE_8, "stop.elapsed=4 s", "testbed.robots_per_node=2",
        "faults=[{at: 2 s, host: robot_3, down_for: 1 s}, {at: 2 s, host: workstation, "
        "down_for: 40 ms}]"),
    "no delay at all": (MAZE_8, "stop.elapsed=3 s", f"{LAN}={{model: ideal, delay: 0 s}}"),
    "a delay of several scans": (MAZE_8, "stop.elapsed=4 s",
                                 f"{LAN}={{model: ideal, delay: 90 ms}}"),
    "odometry": (MAZE_8, "stop.elapsed=3 s", "robot.localization=odometry"),
}


def listens_by_callback(topic, host, latest, subscriptions, listens=Topic.listens):
    """``Topic.listens`` of a topic that knows of no host without a callback."""
    listens(topic, host, latest, subscriptions)
    topic.latest.clear()


def singly(patch):
    """Each message for itself, and an event for each arrival."""
    patch.setattr(BatchPublisher, "_members", lambda batches: [])
    patch.setattr(Topic, "listens", listens_by_callback)


def digests(case, **options):
    outcome = finished(built(*case, **options))
    return outcome.digest, outcome.digest_by_entity


@pytest.mark.parametrize("case", CASES | MORE)
def test_a_run_is_the_same_message_by_message(case):
    in_batches = digests((CASES | MORE)[case])
    with pytest.MonkeyPatch.context() as patch:
        singly(patch)
        assert digests((CASES | MORE)[case]) == in_batches


@settings(max_examples=12)
@given(st.integers(0, 10**6), st.sampled_from(["2 Mb/s", "8 Mb/s", "30 Mb/s", "1 Gb/s"]),
       st.sampled_from(["pfifo", "fq_codel"]), st.integers(1, 3),
       st.lists(st.tuples(st.integers(1, 3000), st.integers(1, 900),
                          st.sampled_from(["robot_0", "robot_2", "workstation"])),
                max_size=3, unique_by=lambda fault: fault[2]))
def test_whatever_befalls_it(seed, rate, queue, per_node, faults):
    stops = ", ".join(f"{{at: {at} ms, host: {host}, down_for: {down} ms}}"
                      for at, down, host in faults)
    case = (HELLO, "stop.elapsed=3 s", f"testbed.robots_per_node={per_node}",
            f"{LAN}={{model: switch, rate: {rate}, queue: {queue}, buffer: 6 kB, rules: "
            "[{rule: loss, probability: 1 %}]}" if seed % 3 == 0 else
            f"{LAN}={{model: switch, rate: {rate}, queue: {queue}, buffer: 6 kB}}",
            f"faults=[{stops}]")
    in_batches = digests(case, seed=seed)
    with pytest.MonkeyPatch.context() as patch:
        singly(patch)
        assert digests(case, seed=seed) == in_batches


def test_scans_and_poses_go_in_batches():
    seen = [0, 0]
    with pytest.MonkeyPatch.context() as patch:
        send_many, publish = Switch.send_many, BatchPublisher._publish
        patch.setattr(Switch, "send_many", lambda model, frames: (
            seen.__setitem__(0, seen[0] + len(frames.receivers)), send_many(model, frames))[1])
        patch.setattr(BatchPublisher, "_publish", lambda batches, content: (
            sent := publish(batches, content), seen.__setitem__(1, seen[1] + (not sent)))[0])
        built(MAZE_8, "stop.elapsed=2 s").run()
    assert seen == [8 * (51 + 21), 0]


@pytest.mark.parametrize("name, broken", [
    ("hand_over", lambda member, batch: None),
    ("newer", lambda member, known: None),
    ("message", lambda member, batch: None),
])
def test_the_twins_that_lose_messages_differ(name, broken):
    sound = digests(MORE["odometry"])
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Member, name, broken)
        try:
            assert digests(MORE["odometry"]) != sound
        except AttributeError:
            assert name == "message"
