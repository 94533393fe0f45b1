"""SLAM on another host than the robot's: what goes over the network, and what the robot knows."""

import pytest
from runs import HELLO, Tally, built, finished, outcome_of

from desim.errors import InputError
from desim.monitor.summary import summarize
from desim.robot.localization.remote_slam import RemoteSlam
from desim.robot.mapping.map_receiver import MapReceiver
from desim.robot.mapping.tiles import Layer
from desim.units import NS_PER_S

MS = 10**6
BASE = "robot.localization={model: gmapping, particles: 5, host: base}"
ALONE = (BASE, "hosts={base: {}}", "deployment=field", "fleet.size=1")
TEAM = (BASE, "hosts={base: {at: [0 m, 0 m]}}", "deployment=field")
# Every message takes 30 ms, and nothing else does.
LATE = "network.media={air: {model: ideal, rules: [{rule: latency, delay: 30 ms, jitter: 0 ms}]}}"
GRID_BYTES = 96 + len("/p3dx0_tf/map") + 121 * 121


def known_at_base(simulation):
    """The cells that each robot's SLAM has drawn."""
    return {node.namespace: node.robot_map.own.snapshot().cells() for node
            in simulation.graph.host("base").nodes if isinstance(node, RemoteSlam)}


def test_which_messages_go_where():
    """A whole log: scans and odometry there, the transform and the map back, and nothing else."""
    log = []

    def note(message, receiver, time_ns, reason, first_ns, last_ns):
        assert reason is None
        log.append((time_ns // MS, message.origin.name, receiver, message.topic,
                    message.size_bytes))

    simulation = built(HELLO, *ALONE, LATE, "stop.elapsed=260 ms", on_fate=note)
    simulation.run()
    base, robot = (simulation.graph.host(name).index for name in ("base", "robot_0"))
    scans = [(at + 30, "robot_0", base, "/robot_0/scan", 797) for at in range(0, 240, 40)]
    odometry = [(at + 30, "robot_0", base, "/robot_0/odom", 738) for at in (0, 100, 200)]
    transforms = [(at + 60, "base", robot, "/robot_0/map_to_odom", 107) for at in (0, 100, 200)]
    maps = [(60, "base", robot, "/robot_0/slam_map", GRID_BYTES)]
    assert sorted(log) == sorted([*scans, *odometry, *transforms, *maps])


def test_the_map_of_the_robot_is_the_one_that_arrived():
    """Scans that were drawn since the last message are not known to the robot."""
    simulation = built(HELLO, *ALONE, LATE, "robot.localization.map_period=10 s",
                       "stop.elapsed=4 s")
    simulation.run()
    assert simulation.graph.topics["/robot_0/slam_map"].counts.delivered == 1
    own = simulation.monitor.maps["robot_0"].own.snapshot().cells()
    drawn = known_at_base(simulation)["robot_0"]
    assert 0 < (own != 0).sum() < (drawn != 0).sum()


@pytest.mark.parametrize("shares", [False, True], ids=["as it is", "twin"])
def test_a_robot_reads_nothing_of_the_base_but_messages(shares, monkeypatch):
    """Between two maps the robot's does not change. The twin hands the layer itself over, which
    goes on being drawn."""
    if shares:
        monkeypatch.setattr(Layer, "of", classmethod(lambda cls, whole: layers[-1]))
    layers, seen = [], []
    publish, receive = RemoteSlam._publish_map, MapReceiver._on_map
    monkeypatch.setattr(RemoteSlam, "_publish_map", lambda node: (
        layers.append(node.robot_map.own), publish(node))[1])
    monkeypatch.setattr(MapReceiver, "_on_map", lambda node, message: (
        receive(node, message),
        seen.append((node.robot_map.own, message.content.layer.cells())))[0])
    simulation = built(HELLO, *ALONE, LATE, "stop.elapsed=12 s")
    simulation.run()
    kept = [bool((own.snapshot().cells() == cells).all()) for own, cells in seen]
    assert len(kept) == 3
    assert all(kept) != shares


def test_a_robot_goes_on_by_its_last_correction_while_the_link_is_cut():
    cut = ("network.media={air: {model: ideal, rules: [{rule: outage, links: [[base, robot_0]], "
           "from: 4 s, until: 14 s}]}}")
    known, poses = {}, []
    simulation = built(HELLO, *ALONE, cut, "stop.elapsed=20 s")
    robot_map = lambda: int((simulation.monitor.maps["robot_0"].fused != 0).sum())  # noqa: E731
    simulation.graph.listeners["believed"] = lambda *_: (
        poses.append(simulation.kernel.now_ns),
        known.update({simulation.kernel.now_ns // NS_PER_S: robot_map()}))
    simulation.run()
    assert known[5] == known[13] > 0
    assert known[19] > known[13]
    assert len(poses) == 21  # the first, and one each second, whatever the link does


def test_whoever_runs_slam_pays_for_it():
    """Processor time and memory are those of the host where the node runs."""
    costs = ("computers={model: table, callbacks: {slam: {odom: {fixed: 10 ms}}}, memory: "
             "{processes: {slam: {fixed: 3 MB}, pose_publisher: {fixed: 1 MB}}}}")
    for choice, slam_on, other in (("base", "base", "robot_0"), ("null", "robot_0", "base")):
        simulation = built(HELLO, *ALONE, f"robot.localization.host={choice}", costs,
                           "stop.elapsed=3050 ms",
                           "network.media={air: {model: ideal}}")
        simulation.run()
        hosts = {name: simulation.graph.host(name) for name in ("base", "robot_0")}
        assert hosts[slam_on].computer.processors.busy_ns() == 31 * 10 * MS
        assert hosts[other].computer.processors.busy_ns() == 0
        used = {name: host.memory.used_bytes() for name, host in hosts.items()}
        assert used == {other: 0, slam_on: 3_000_000, "robot_0": 1_000_000 + 3_000_000 * (
            slam_on == "robot_0")}
        found = summarize(simulation.monitor, simulation.kernel.now_ns)
        own = {**found["hosts"], **found["robots"]}
        assert list(found["hosts"]) == ["base"]
        assert own[slam_on]["cpu_s"] == pytest.approx(0.31)
        assert own[slam_on]["cpu_percent"] == pytest.approx(100 * 0.31 / (2 * 3.05))
        assert own[other]["cpu_percent"] == 0
        assert {name: own[name]["peak_ram_mb"] * 1e6 for name in hosts} == used
        for towards, away in (("rx_kBps", "tx_kBps"), ("tx_kBps", "rx_kBps")):
            assert own["base"][towards] == own["robot_0"][away]


def test_a_busy_base_serves_a_fleet_late():
    """Three robots' SLAM on one slow processor: corrections are fewer, and scans are skipped."""
    def corrections(processors):
        simulation = built(HELLO, *TEAM, "network.media={air: {model: ideal}}",
                           "computers={model: table, callbacks: {slam: {odom: {fixed: 90 ms}}}}",
                           f"hosts.base.computer.processors={processors}", "stop.elapsed=5 s")
        simulation.run()
        return sum(simulation.graph.topics[f"/robot_{i}/map_to_odom"].counts.delivered
                   for i in range(3))

    assert corrections(3) == 3 * 50
    assert corrections(1) == pytest.approx(5 / 0.09, abs=3)


@pytest.mark.parametrize("middleware", ["direct", "ros1"])
@pytest.mark.parametrize("deployment", ["field", "testbed"])
def test_a_fleet_explores(middleware, deployment):
    tally = Tally()
    simulation = built(HELLO, *TEAM, f"deployment={deployment}", f"middleware={middleware}",
                       "stop.elapsed=80 s", on_fate=tally.fate)
    finished(simulation)
    found = summarize(simulation.monitor, simulation.kernel.now_ns)
    assert found["exploration_time_s"] is not None
    assert found["map_quality"] > 0.97
    assert found["ate_m"] < 0.1
    assert tally.delivered["/robot_2/slam_map"] > 3


def test_a_robot_may_run_the_slam_of_its_team():
    simulation = built(HELLO, BASE.replace("base", "robot_1"), "deployment=field",
                       "stop.elapsed=5 s")
    simulation.run()
    names = {host.name: [node.name for node in host.nodes if node.name.endswith("slam")]
             for host in simulation.graph.hosts}
    assert names == {"robot_0": [], "robot_1": ["robot_0/slam", "robot_2/slam", "slam"],
                     "robot_2": []}
    sent = {name for name, topic in simulation.graph.topics.items()
            if name.endswith(("scan", "slam_map")) and topic.counts.delivered}
    assert sent == {f"/robot_{i}/{topic}" for i in (0, 2) for topic in ("scan", "slam_map")}


@pytest.mark.parametrize("host", ["base", "robot_1"])
def test_hosts_that_stop_and_start_keep_the_books_balanced(host):
    simulation = built(HELLO, *TEAM, f"faults=[{{at: 4 s, host: {host}, down_for: 3 s}}]",
                       "stop.elapsed=12 s")
    finished(simulation)
    assert simulation.graph.topics["/robot_1/map_to_odom"].counts.delivered > 60


@pytest.mark.parametrize("payloads", ["birth", "delivery"])
def test_it_does_not_matter_when_a_content_is_computed(payloads):
    run = (HELLO, *TEAM, "stop.elapsed=10 s")
    assert outcome_of(*run, payloads=payloads).digest == outcome_of(*run).digest


def test_hosts_without_a_medium_in_common_are_refused():
    with pytest.raises(InputError) as refused:
        built(HELLO, *TEAM, "network.media={air: {model: disk, hosts: [robot_0, robot_1]}}")
    assert str(refused.value) == (
        "robot.localization.host: robot_0 and base have no medium in common "
        "(network.media.*.hosts), and no host forwards")
