"""Will it carry? What a scenario's topics ask of its media, against sums by hand and runs."""

import numpy as np
import pytest

from desim.commands.views.fleet_load import description, verdict
from desim.engine.streams import Streams
from desim.middleware.contents import occupancy_grid_bytes
from desim.middleware.headers import stream_frame
from desim.netcases import fleet_load
from desim.netcases.fleet_load import FleetLoad
from desim.netcases.map_message_size import free_place
from desim.netcases.message_load import Pace
from desim.scenario.load import from_mapping
from desim.simulation.simulation import Simulation

S = 10**9


def scenario(size=3, deployment="testbed", lan="ideal", overrides=(), **more):
    lan = {"model": lan} if isinstance(lan, str) else lan
    return from_mapping({
        "name": "small", "deployment": deployment,
        "environment": {"terrain": {"size": ["20 m", "12 m"]}},
        "fleet": {"size": size, "start": {"from": ["-6 m", "0 m"], "step": ["3 m", "0 m"]}},
        "network": {"media": {"lan": lan}}, **more}, overrides).scenario


def play(of, **options):
    return fleet_load.play(of, FleetLoad(scenario="", **options))


def test_offered_is_what_the_topics_sum_up_to():
    """Three robots in a testbed: sensors from the workstation, commands and maps to it, and each
    map to two others. Nothing takes time."""
    of = scenario()
    grid = Simulation(of).grid
    map_bytes = occupancy_grid_bytes(grid.width * grid.height)
    found = play(of)
    by_hand = {  # messages a second, bytes
        "/*/scan": (75, 797), "/*/true_pose": (30, 738), "/*/cmd_vel": (30, 48),
        "/*/explored_map": (3, map_bytes), "/*/distance": (3, 8),
        "/map_exchange/*": (3 * 2 / 5, map_bytes)}
    assert (found["map_bytes"], found["left_out"]) == (map_bytes, [])
    assert set(found["topics"]) == set(by_hand)
    for name, (per_s, size_bytes) in by_hand.items():
        topic = found["topics"][name]
        assert (topic["sent"], topic["size_bytes"]) == (20 * per_s, size_bytes), name
        assert topic["offered_mbps"] == pytest.approx(per_s * size_bytes * 8e-6)
        assert (topic["delivered"], topic["lost"], topic["delay_p99_ms"]) == (20 * per_s, {}, 0.0)
    lan = found["media"]["lan"]
    assert lan["offered_mbps"] == lan["carried_mbps"] == pytest.approx(sum(
        per_s * stream_frame(size_bytes)[0] * 8e-6 for per_s, size_bytes in by_hand.values()))
    assert lan["utilisation"] is None
    assert verdict(found, 0.99) == (
        True, "carries: 1 of all messages arrive, 95 % of each topic's within 0 ms (/*/cmd_vel)")


def test_the_twin_of_another_rate():
    """A laser of 23 Hz is not one of 25 Hz."""
    found = play(scenario(robot={"laser": {"rate": "23 Hz"}}))
    assert found["topics"]["/*/scan"]["sent"] == 20 * 3 * 23 != 20 * 75


def test_a_run_says_the_same():
    """Messages that do not depend on driving are as many and as large in a run of ten seconds, of
    which the prediction has the second half. Sensors begin at time 0."""
    of = from_mapping({"name": "two", "fleet": {"size": 2}}).scenario
    simulation = Simulation(of)
    assert simulation.run(10 * S).simulated_ns == 10 * S
    simulated = {name: topic.counts for name, topic in simulation.graph.topics.items()
                 if topic.counts.intended}
    found = play(of, duration="5 s")["topics"]  # from 5 s to 10 s
    robots = frozenset({"robot_0", "robot_1"})
    assert {fleet_load.family(name, robots) for name in simulated} == set(found)
    for kind, at_zero in ("scan", 1), ("true_pose", 1), ("explored_map", 0), ("distance", 0):
        counts = [simulated[f"/robot_{i}/{kind}"] for i in range(2)]
        sent = sum(own.intended - at_zero for own in counts)
        assert 2 * found[f"/*/{kind}"]["sent"] == sent
        assert all(own.bytes == own.delivered * found[f"/*/{kind}"]["size_bytes"]
                   for own in counts)


def test_in_the_field_only_maps_cross_and_what_a_base_collects():
    air = {"lan": None, "air": {"model": "disk"}}
    found = play(scenario(deployment="field", network={"media": air}), map="5 kB")
    assert (list(found["topics"]), found["map_bytes"]) == (["/map_exchange/*"], 5000)
    base = play(scenario(deployment="field", network={"media": air},
                         hosts={"base": {"monitor": True}}))
    assert {name: topic["receivers"] for name, topic in base["topics"].items()} == {
        "/*/distance": 1, "/*/explored_map": 1, "/map_exchange/*": 3}


def test_nothing_to_say():
    found = play(scenario(1, deployment="field", network={"media": {"air": {"model": "disk"}}}))
    assert found["topics"] == {}
    assert verdict(found, 0.99) == (True, "carries: nothing is said between hosts")
    assert "medium" in description(found)


def overloaded(rate):
    """Two robots tell each other 100 kB every half second over links of ``rate``."""
    lan = {"model": "link", "rate": rate}
    return play(scenario(2, "field", lan, coordination={"exchange": {"period": "500 ms"}}),
                map="100 kB", duration="60 s")


def test_a_line_that_is_too_narrow_carries_what_it_can():
    """1 Mb/s for frames of 104 834 B: one after the other, each 0.84 s; what waits is replaced."""
    frame_bytes = stream_frame(100_000)[0]
    found = overloaded("1 Mb/s")
    topic, lan = found["topics"]["/map_exchange/*"], found["media"]["lan"]
    expected = 1e6 / (8 * frame_bytes) / 2
    assert topic["offered_mbps"] == pytest.approx(3.2)
    assert topic["delivery_ratio"] == pytest.approx(expected, rel=0.02)
    assert lan["utilisation"] == {"mean": pytest.approx(1), "max": pytest.approx(1)}
    assert lan["carried_mbps"] == pytest.approx(2, rel=0.02)
    carries, said = verdict(found, 0.99)
    assert not carries
    assert said.startswith("does not carry: /map_exchange/* loses 40")
    assert "(outbox_full" in said
    twin = overloaded("0.92 Mb/s")["topics"]["/map_exchange/*"]["delivery_ratio"]
    assert twin != pytest.approx(expected, rel=0.02)


def test_the_same_answer_again_and_other_phases_with_another_seed():
    radio = {"model": "radio"}
    one, again = (play(scenario(5, "field", radio)) for _ in range(2))
    assert one == again
    assert one != play(scenario(5, "field", radio, overrides=["seed=2"]))
    assert 0 < one["media"]["lan"]["utilisation"]["max"] < 0.2


def test_robots_anywhere():
    """By their names: one more robot moves nobody. Far from each other less arrives."""
    ground = Simulation(scenario(2)).monitor.truth.ground
    places = [free_place(ground, Streams(1), "spread", f"robot_{k}") for k in range(40)]
    cells = [ground.grid.cell(*place) for place in places]
    assert all(ground.reachable[row, column] for column, row in cells)
    assert np.ptp(places, axis=0) == pytest.approx([20, 12], rel=0.2)
    disk = {"model": "disk", "range": "5 m"}
    shares = [play(scenario(4, "field", disk), map="1 kB", spread=spread)["topics"][
        "/map_exchange/*"]["delivery_ratio"] for spread in (False, True)]
    assert shares[0] != shares[1]


def test_topics_that_nobody_has_a_rate_for_are_named(monkeypatch):
    monkeypatch.setattr(fleet_load, "paces", lambda *_: {"scan": Pace(25, 797)})
    found = play(scenario())
    assert list(found["topics"]) == ["/*/scan"]
    assert found["left_out"] == ["/*/cmd_vel", "/*/distance", "/*/explored_map", "/*/true_pose",
                                 "/map_exchange/*"]
    assert "left out, for nobody says how often: /*/cmd_vel, " in description(found)


def test_packets_that_codel_takes_from_trains_are_in_the_table():
    """Of a map of 30 kB CoDel drops packets, never all of a train: no frame is lost, packets are.
    Four maps of 6 Mb/s at 2 Mb/s, of which half go down a second time."""
    of = from_mapping({
        "name": "full", "deployment": "field", "stop": {"elapsed": "30 s"},
        "environment": {"terrain": {"size": ["20 m", "12 m"]}},
        "fleet": {"size": 4, "start": {"from": ["-6 m", "0 m"], "step": ["3 m", "0 m"]}},
        "network": {"media": {"air": {
            "model": "radio", "standard": "11b", "rate": "2 Mb/s",
            "access_points": [{"at": ["0 m", "0 m"]}]}}}}).scenario
    found = play(of, map="150 kB")
    air = found["media"]["air"]
    assert air["packets_lost"]["downlink_codel"] > 100
    assert "downlink_codel" not in air["lost"]
    assert air["packets"] > air["frames"]
    share = air["packets_lost"]["downlink_codel"] / air["packets"]
    assert f"downlink_codel {share:.1%}" in description(found)
