"""Whole runs on computers that get busy."""

import numpy as np
import pytest
from runs import HELLO, MAZE_8, ROUGH, built, finished, outcome_of

from desim.advice.warnings import warnings
from desim.engine.kernel import Phase
from desim.errors import InputError
from desim.monitor.summary import robots_table, samples_table, summarize
from desim.units import NS_PER_S

SHORT = "stop.elapsed=20 s"
SLAM = "robot.localization={model: gmapping, least_particles: 30}"
# A beam of a particle as in openslam's gmapping, rounded, and some more.
COSTS = ("computers={model: table, callbacks: {slam: {odom: {fixed: 20 us, per: {beams: 27 us}}}, "
         "move_base: {any: {fixed: 1 ms}}, explore: {tick: {fixed: 5 ms}}}, "
         "send: {link: 20 us}, receive: {message: 20 us, byte: 1 ns}}")


@pytest.mark.parametrize(("file", "overrides"), [
    (HELLO, ()), (HELLO, ("deployment=field",)), (ROUGH, ()), (MAZE_8, ("stop.elapsed=10 s",)),
    (HELLO, ("deployment=field", "middleware=ros1"))])
def test_callbacks_without_a_cost_change_no_digest(file, overrides):
    """The same rows and the same events, although each node has a queue and waits for its turn."""
    ideal = outcome_of(file, SHORT, *overrides)
    assert outcome_of(file, SHORT, *overrides, "computers=table") == ideal
    assert outcome_of(file, SHORT, *overrides, "computers=ideal", "robot.computer.speed=0.05"
                      ) == ideal


def explored_s(*overrides):
    simulation = built(HELLO, SLAM, *overrides)
    finished(simulation)
    return summarize(simulation.monitor, simulation.kernel.now_ns)


def test_slow_computers_delay_a_fleet():
    ideal, usual = explored_s(), explored_s(COSTS)
    slow = explored_s(COSTS, "robot.computer.speed=0.03")
    assert usual["exploration_time_s"] < 1.2 * ideal["exploration_time_s"]
    assert slow["exploration_time_s"] > 1.5 * ideal["exploration_time_s"]
    assert usual["mean_cpu_percent"] < 15 < 50 < slow["mean_cpu_percent"]
    assert (ideal["mean_cpu_percent"], ideal["missed_ticks"]) == (None, 0)


def test_a_computer_that_cannot_keep_up_misses_ticks_and_replaces_messages():
    simulation = built(HELLO, SLAM, COSTS, "robot.computer={processors: 1, speed: 0.01}", SHORT)
    finished(simulation)
    found = summarize(simulation.monitor, simulation.kernel.now_ns)
    assert found["mean_cpu_percent"] > 95
    assert found["missed_ticks"] > 100
    assert simulation.graph.topics["/robot_0/odom"].counts.overwritten > 50


def driven_m(**costs):
    rows = ", ".join(f"{node}: {{any: {{fixed: {cost} ms}}}}" for node, cost in costs.items())
    simulation = built(HELLO, f"computers={{model: table, callbacks: {{{rows}}}}}",
                       "robot.computer.processors=4", SHORT)
    finished(simulation)
    commands = sum(simulation.graph.topics[f"/robot_{i}/cmd_vel"].counts.delivered
                   for i in range(3))
    return sum(simulation.world.travelled_m()), commands


def test_a_robot_stops_when_its_pose_is_old_and_drives_on_old_commands():
    usual_m, commands = driven_m()
    blind_m, _ = driven_m(localization=1500)
    assert blind_m < 0.2 * usual_m
    busy_m, few = driven_m(move_base=400)
    assert few < 0.5 * commands
    assert blind_m < 0.2 * busy_m < 0.2 * usual_m


@pytest.mark.parametrize("payloads", ["birth", "delivery"])
def test_it_does_not_matter_when_a_content_is_computed(payloads):
    busy = (HELLO, SLAM, COSTS, SHORT, "robot.computer.speed=0.1")
    assert outcome_of(*busy, payloads=payloads).digest == outcome_of(*busy).digest


@pytest.mark.parametrize("scheduling", ["fifo", "fixed_priority", "processor_sharing"])
def test_hosts_that_stop_and_start_keep_the_books_balanced(scheduling):
    faults = "faults=[{at: 5 s, host: robot_1, down_for: 5 s}, {at: 7 s, host: robot_2}]"
    simulation = built(HELLO, COSTS, faults, SHORT, "robot.computer.speed=0.02",
                       f"robot.computer.scheduling={scheduling}",
                       "robot.computer.priorities={move_base: 2, localization: 1}")
    finished(simulation)


def test_the_load_of_processors_is_measured():
    simulation = built(HELLO, COSTS, "robot.computer={processors: 3, speed: 0.1}", SHORT)
    simulation.run()
    monitor, now_ns = simulation.monitor, simulation.kernel.now_ns
    found, samples, robots = summarize(monitor, now_ns), samples_table(monitor), robots_table(
        monitor)
    own = list(found["robots"].values())
    assert [robot["cpu_percent"] for robot in own] == pytest.approx(
        [100 * robot["cpu_s"] / (3 * 20) for robot in own])
    assert found["mean_cpu_percent"] == pytest.approx(
        sum(robot["cpu_percent"] for robot in own) / 3)
    assert samples["time_s"] == [0, 5, 10, 15, 20, 20]
    assert samples["cpu_percent"][0] is None and samples["cpu_percent"][-1] is None
    assert found["mean_cpu_percent"] == pytest.approx(sum(samples["cpu_percent"][1:5]) / 4)
    assert list(robots["cpu_s"][-3:]) == [robot["cpu_s"] for robot in own]
    assert list(robots["missed_ticks"][-3:]) == [robot["missed_ticks"] for robot in own]


def test_names_of_nodes_that_never_ran_are_said():
    rows = ("computers={model: table, callbacks: {slamm: {odom: {fixed: 1 ms}}, move_base: {any: "
            "{fixed: 1 ms}, kontrol: {fixed: 1 ms}, control: {fixed: 1 ms}}}, memory: {processes: "
            "{mov_base: {fixed: 1 MB}}}}")
    simulation = built(HELLO, SLAM, rows, "robot.computer={scheduling: fixed_priority, "
                       "priorities: {move_base: 2, explorer: 1}}", "stop.elapsed=3 s")
    simulation.run()
    assert [text for text in warnings(simulation.monitor) if "node" in text] == [
        "computer.priorities: no node of the run was called 'explorer' (did you mean 'explore'?)",
        "computers: no node of the run was called 'slamm' (did you mean 'slam'?)",
        "computers: no node of the run was called 'mov_base' (did you mean 'move_base'?)",
        "computers: node 'move_base' had no trigger 'kontrol' (did you mean 'control'?); it had: "
        "control, goal, observe"]
    simulation = built(HELLO, COSTS, SLAM, "stop.elapsed=3 s")
    simulation.run()
    assert not warnings(simulation.monitor)


def test_quantities_that_never_come_are_said():
    simulation = built(HELLO, "computers={model: table, callbacks: {move_base: {control: {per: {"
                       "beams: 1 ns, candidates: 1 ns, scans: 1 ns}}, any: {per: {cells: 1 ns}}}, "
                       "tf: {tf: {per: {bytes: 1 ns}}}}}", "robot.tf=own", "stop.elapsed=3 s")
    simulation.run()
    assert [text for text in warnings(simulation.monitor) if "computers" in text] == [
        "computers: 'control' of node 'move_base' never declared scans, beams; it declared: "
        "candidates", "computers: 'tf' of node 'tf' never declared bytes; it declared: "
        "nothing"]


MEMORY = (COSTS[:-1] + ", memory: {system: 30 MB, processes: {slam: {fixed: 1 MB, per: {patches: "
          "16.7 kB, scans: 29 kB}}, map_sharing: {per: {bytes: 1 B, cells: 1 B}}}}}")
SMALL = "robot.computer={memory: 41.3 MB, respawn_delay: 2 s}"


def test_memory_is_what_nodes_keep():
    simulation = built(HELLO, SLAM, MEMORY, "robot.computer.memory=100 MB", SHORT)
    simulation.run()
    monitor, now_ns = simulation.monitor, simulation.kernel.now_ns
    found, robots = summarize(monitor, now_ns), robots_table(monitor)
    for i, (name, robot) in enumerate(found["robots"].items()):
        nodes = {node.name: node for node in simulation.graph.host(name).nodes}
        slam, sharing = nodes["slam"].kept(), nodes["map_sharing"].kept()
        assert slam["patches"] > 30 and slam["scans"] > 10
        assert sharing["cells"] == (2 + 2) * monitor.truth.ground.grid.cells
        used_bytes = simulation.graph.host(name).memory.used_bytes()
        assert used_bytes >= 31_000_000 + 16_700 * slam["patches"] + 29_000 * slam["scans"] + (
            sharing["cells"])
        own = robots["ram_mb"][i::3]
        assert own[-1] == used_bytes / 1e6
        assert robot["ram_mb"] == robot["ram_percent"] == pytest.approx(own.mean())
        assert (robot["peak_ram_mb"], robot["killed"]) == (own.max(), {})
    assert found["mean_ram_percent"] == pytest.approx(robots["ram_mb"].mean())
    assert samples_table(monitor)["ram_mb"][-1] == pytest.approx(robots["ram_mb"][-3:].mean())


CAMERA = ("deployment=field", "fleet.size=1", "hosts={base: {}}", "stop.elapsed=3 s",
          "network={media: {lan: {model: switch, rate: 100 Mb/s}}}",
          "robot.publishes=[{topic: cam, size: 921 kB, rate: 100 Hz, to: base, queue: 0}]")


@pytest.mark.parametrize("costs", [
    "measured", "{model: table, memory: {processes: {cam_publisher: {per: {bytes: 1 B}}}}}",
    "{model: table, memory: {processes: {any: {per: {bytes: 1 B}}}}}"])
def test_messages_that_wait_at_their_publisher_take_memory(costs):
    """Seven of eight wait: the network carries 12.5 MB of 92.1 MB a second."""
    simulation = built(HELLO, *CAMERA, f"computers={costs}")
    simulation.run()
    counts = simulation.graph.topics["/robot_0/cam"].counts
    waiting = counts.intended - counts.delivered
    assert waiting > 250
    assert not [text for text in warnings(simulation.monitor) if "node" in text]
    sizes = simulation.graph.host("robot_0").memory.of_processes()
    assert sizes["cam_publisher"] == 921_000 * waiting
    simulation = built(HELLO, *CAMERA, f"computers={costs}", "robot.computer.memory=200 MB")
    simulation.run()
    killed = summarize(simulation.monitor, simulation.kernel.now_ns)["robots"]["robot_0"]["killed"]
    assert killed == {"cam_publisher": 1}  # it fills in 2 s


def test_conditions_know_the_work_of_computers():
    """At the samples, of which one is due each second."""
    simulation = built(HELLO, SLAM, MEMORY, SMALL, SHORT, "measure={every: 1 s, when: [cpu_s > 1, "
                       "memory_kills > 0]}", "stop.when=memory_kills > 1 and ram_mb < 100")
    simulation.run()
    monitor = simulation.monitor
    samples, robots = samples_table(monitor), robots_table(monitor)
    assert monitor.stop_reason == "condition: memory_kills > 1 and ram_mb < 100"
    for name, total in (("cpu_s", sum), ("missed_ticks", sum), ("memory_kills", sum),
                        ("ram_mb", np.mean)):
        assert samples[name][-1] == pytest.approx(total(robots[name][-3:]))
    for name, least in (("cpu_s", 1), ("memory_kills", 0)):
        first = next(i for i, now in enumerate(samples[name]) if now > least)
        assert f"{name} > {least}" in samples["cause"][first]


@pytest.mark.parametrize(("overrides", "of_robot"), [
    ((SLAM,), True),
    (("robot.localization={model: gmapping, host: workstation}", "testbed.computer.speed=0.01"),
     False)])
def test_conditions_know_the_load_of_the_busiest_host(overrides, of_robot):
    """Of robots and others, in the window of 5 s that ended last; of memory, at its end."""
    simulation = built(HELLO, MEMORY, "robot.computer.memory=200 MB", "stop.elapsed=11 s",
                       *overrides, "measure={every: 1 s, when: [max_cpu_percent > 0]}")
    simulation.run()
    samples, robots = samples_table(simulation.monitor), robots_table(simulation.monitor)
    loads = samples["max_cpu_percent"]
    assert np.isnan(loads[:5]).all()
    assert [i for i, cause in enumerate(samples["cause"]) if ">" in cause] == [5]
    assert len(set(loads[5:10])) == len(set(loads[10:])) == 1
    cpu_s = robots["cpu_s"].reshape(-1, 3)
    of_robots = [100 * np.max(cpu_s[end] - cpu_s[end - 5]) / (2 * 5) for end in (5, 10)]
    if of_robot:
        assert [loads[5], loads[10]] == pytest.approx(of_robots)
    else:
        assert loads[10] > 2 * of_robots[1]
    fullest = robots["ram_percent"].reshape(-1, 3)[10].max()
    assert samples["max_ram_percent"][10] == pytest.approx(fullest)


def test_a_robot_without_memory_enough_dies_and_starts_empty():
    finished(built(HELLO, SLAM, MEMORY, SMALL, SHORT))
    simulation = built(HELLO, SLAM, MEMORY, SMALL, SHORT)
    simulation.run()
    monitor = simulation.monitor
    found, robots = summarize(monitor, simulation.kernel.now_ns), robots_table(monitor)
    assert found["memory_kills"] == sum(robot["killed"]["slam"]
                                        for robot in found["robots"].values() if robot["killed"])
    assert list(robots["memory_kills"][-3:]) == [sum(robot["killed"].values())
                                                 for robot in found["robots"].values()]
    used_mb, known = robots["ram_mb"][::3], robots["explored"][::3]
    down = (used_mb == 0).nonzero()[0]
    assert max(used_mb) <= 41.3
    assert len(down) == 2 * found["robots"]["robot_0"]["killed"]["slam"] > 0
    assert known[down[0] - 1] > 0.7 and known[down[0]] == 0  # and teammates tell it most again
    assert used_mb[down[1] + 1] < used_mb[down[0] - 1]


def test_a_computer_without_memory_for_its_system_is_refused():
    with pytest.raises(InputError) as refused:
        built(HELLO, SLAM, MEMORY, "robot.computer.memory=30 MB", "testbed.computer.memory=31 MB",
              "hosts={base: {computer: {memory: 12 MB}}}", "fleet.types={big: {robot: {computer: "
              "{memory: 31 MB}}}, own: {robot: {laser: lms500}}}")
    takes = "must be above 30 MB, which the system takes with computers: table, got"
    assert refused.value.args == (f"robot.computer.memory: {takes} '30 MB'",
                                  f"hosts.base.computer.memory: {takes} '12 MB'")


def test_a_computer_without_memory_for_its_software_is_said():
    """hello's nodes take 9 MB at their first callbacks beside the system's 48 MB."""
    def said(memory):
        simulation = built(HELLO, "computers=measured", f"robot.computer.memory={memory}",
                           "stop.elapsed=2 s")
        simulation.run()
        return [text for text in warnings(simulation.monitor) if "memory" in text]
    assert said("50 MB") == [
        "host robot_0 and 2 more: computer.memory is 50 MB, and the system and the software, as it "
        "starts, take 57 MB: the software dies whenever it starts"]
    assert said("80 MB") == []


@pytest.mark.parametrize(("fault", "up_s"), [
    ("", [0.0, 9.0]),  # killed at 5 s, down for 4 s
    ("{at: 6 s, host: robot_0, down_for: 1 s}", [0.0, 9.0]),
    ("{at: 6 s, host: robot_0, down_for: 6 s}", [0.0, 12.0]),
    ("{at: 6 s, host: robot_0, down_for: 3 s}", [0.0, 9.0]),  # both end in one instant
    ("{at: 2 s, host: robot_0, down_for: 1 s}, {at: 8 s, host: robot_0, down_for: 3 s}",
     [0.0, 3.0, 11.0]),
    ("{at: 6 s, host: robot_0}", [0.0])])
def test_a_host_is_down_until_the_last_of_its_outages_has_ended(fault, up_s):
    """Killed for want of memory, and in the same time by a fault of the scenario."""
    rows = []
    simulation = built(HELLO, f"faults=[{fault}]", "robot.computer.respawn_delay=4 s",
                       "stop.elapsed=15 s", trace_sink=lambda batch: rows.append(batch.copy()))
    kernel, names = simulation.kernel, simulation.names
    kernel.after(5 * NS_PER_S, Phase.CONTROL, names.id("robot_0"),
                 simulation.graph.listeners["out_of_memory"], "robot_0")
    simulation.run()
    rows = np.concatenate(rows)
    starts = rows[(rows["kind"] == names.id("host_started"))
                  & (rows["entity"] == names.id("robot_0"))]
    assert (starts["t_ns"] / NS_PER_S).tolist() == up_s


def test_a_limit_that_is_not_reached_changes_nothing():
    outcome = outcome_of(HELLO, SLAM, MEMORY, SHORT)
    assert outcome_of(HELLO, SLAM, MEMORY, SHORT, "robot.computer.memory=100 MB") == outcome
    assert outcome_of(HELLO, SLAM, COSTS, SHORT) == outcome
    assert outcome_of(HELLO, SLAM, MEMORY, SHORT, SMALL).digest != outcome.digest


def explored(*overrides):
    """The summary of 20 s of three robots, each on a virtual machine of one processor."""
    simulation = built(HELLO, SLAM, COSTS, "robot.computer={processors: 1, speed: 0.5}", SHORT,
                       *overrides)
    finished(simulation)
    return summarize(simulation.monitor, simulation.kernel.now_ns)


def test_virtual_machines_share_the_processors_of_their_node():
    own, shared = explored(), explored("testbed.processors_per_node=1")
    for found in (own, shared):
        node = found["cluster_nodes"]["node_0"]
        assert node["cpu_s"] + node["waited_s"] == pytest.approx(
            sum(robot["cpu_s"] for robot in found["robots"].values()))
    assert own["cluster_nodes"]["node_0"]["waited_s"] == 0
    assert shared["mean_node_cpu_percent"] == shared["cluster_nodes"]["node_0"]["cpu_percent"] > 90
    assert shared["mean_cpu_percent"] > 1.2 * own["mean_cpu_percent"]
    apart = explored("testbed={processors_per_node: 1, robots_per_node: 1}")
    assert list(apart["cluster_nodes"]) == ["node_0", "node_1", "node_2"]
    for key in ("mean_cpu_percent", "mean_node_cpu_percent"):
        assert apart[key] == pytest.approx(own["mean_cpu_percent"], rel=0.05)


def test_nodes_are_of_the_testbed_alone_and_passive_robots_have_no_machine():
    assert explored("deployment=field")["cluster_nodes"] == {}
    simulation = built(HELLO, COSTS, "robot.passive=[robot_1]", "testbed.robots_per_node=2")
    assert [(host.name, host.node) for host in simulation.plan] == [
        ("robot_0", "node_0"), ("robot_1", None), ("robot_2", "node_0"), ("workstation", None)]
    assert simulation.scenario.network.media["lan"].params.ports == {
        "node_0": ("robot_0", "robot_2")}


@pytest.mark.parametrize("deployment", ["testbed", "field"])
def test_a_passive_robot_has_no_loads_and_counts_in_no_mean(deployment):
    simulation = built(HELLO, COSTS[:-1] + ", memory: {system: 30 MB}}", "robot.passive=[robot_1]",
                       f"deployment={deployment}", "stop.elapsed=5 s", "robot.computer.memory=1 GB")
    simulation.run()
    monitor = simulation.monitor
    found = summarize(monitor, simulation.kernel.now_ns)
    samples, table = samples_table(monitor), robots_table(monitor)
    own = found["robots"]
    for name in ("cpu_percent", "ram_mb", "ram_percent", "rx_kBps", "tx_kBps"):
        assert own["robot_1"][name] is None
        others = [own[robot][name] for robot in ("robot_0", "robot_2")]
        assert found[f"mean_{name}"] == pytest.approx(np.mean(others))
    assert samples["ram_mb"][-1] == pytest.approx(np.nanmean(table["ram_mb"][-3:]))
    assert own["robot_1"]["cpu_s"] is own["robot_1"]["peak_ram_mb"] is None
    for name in ("cpu_s", "ram_mb", "ram_percent"):
        assert np.isnan(table[name]).tolist() == [False, True, False] * 6
    for name in ("missed_ticks", "memory_kills", "rx_bytes", "tx_bytes"):
        assert table[name].dtype.kind == "i" and not table[name][1::3].any()


def busy_ms(*case):
    """The time for which the processors of each robot were busy in 5 s."""
    simulation = built(HELLO, "stop.elapsed=5 s", *case)
    simulation.run()
    return [host.computer.processors.busy_ns() / 1e6 for host in simulation.graph.hosts
            if host.name.startswith("robot")]


def test_each_process_pays_for_its_copies():
    """Two more scans 25 times a second, each of which takes 1 ms to receive; the last two instants'
    are under way, or not read yet."""
    receive = "computers={model: table, receive: {message: 1 ms}}"
    alone, copied = busy_ms(receive), busy_ms(receive, "testbed.processes.scan=3")
    assert [round(more - one) for one, more in zip(alone, copied, strict=True)] == [2 * 123] * 3
