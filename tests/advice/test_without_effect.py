"""The warnings of a run about keys that had no effect, each with a twin in which they have one."""

import leaky_rule
import pytest
from runs import HELLO, built

from desim.advice.warnings import warnings
from desim.testing import check_rule

IDEAL = "callbacks take neither time nor memory with computers: ideal"
SAYS = "computers={model: table, memory: {system: 1 MB}}"
ROBOT = ("robot.computer={memory: 1 GB, respawn_delay: 3 s, scheduling: fixed_priority, "
         "priorities: {move_base: 1}}")
POWER = "robot.power={computer: {processor: 9 W}}"
HOSTS = ("testbed.computer.speed=2", "testbed.processors_per_node=4",
         "hosts.base={computer: {processors: 4}}")
TYPES = ("fleet.types={own: {robot: {computer: {memory: 2 GB}}}}", "fleet.robots=own")
FIELD = ("testbed={robots_per_node: 2, monitor_period: 2 s, processes: {scan: 2}}",
         "deployment=field")


FIELD_WITH_BUS = ("deployment=field", "topics={scan: {medium: usb}}")
OTHERS = "network.others={nas: {}}"
FLOW = ("network.background=[{{medium: lan, between: [nas, workstation], rate: 1 Mb/s, "
        "pattern: {}, on: 2 s, off: 8 s}}]")


def said(*overrides):
    simulation = built(HELLO, "stop.elapsed=100 ms", *overrides)
    simulation.run()
    return [text for text in warnings(simulation.monitor) if "no effect" in text]


@pytest.mark.parametrize(("overrides", "line", "twin"), [
    ((ROBOT,), "robot.computer.scheduling, robot.computer.priorities, robot.computer.memory, "
     f"robot.computer.respawn_delay: no effect, because {IDEAL}", SAYS),
    (TYPES, f"fleet.types.own.robot.computer.memory: no effect, because {IDEAL}", SAYS),
    (HOSTS, "hosts.base.computer.processors, testbed.computer.speed, testbed.processors_per_node: "
     f"no effect, because {IDEAL}", "computers=measured"),
    ((POWER,), f"robot.power.computer.processor: no effect, because {IDEAL}", SAYS),
    ((SAYS, "robot.computer.priorities={move_base: 1}"), "robot.computer.priorities: no effect, "
     "because priorities count only with scheduling: fixed_priority",
     "robot.computer.scheduling=fixed_priority"),
    ((SAYS, "robot.computer.respawn_delay=3 s"), "robot.computer.respawn_delay: no effect, because "
     "software dies only where memory has a limit", "robot.computer.memory=1 GB"),
    (("computers=table", "robot.computer.memory=1 GB"), "robot.computer.memory: no effect, "
     "because nothing takes memory with computers: table", SAYS),
    (FIELD, "testbed.robots_per_node, testbed.monitor_period, testbed.processes: no effect, "
     "because deployment is field", "deployment=testbed"),
    (("network.media.lan.model=link", "testbed.robots_per_node=2"), "testbed.robots_per_node: no "
     "effect, because robots on a node share neither processors (computers: ideal) nor a port (no "
     "medium has any)", "network.media.lan.model=switch"),
    (("testbed.processes.tf=4",), "testbed.processes.tf: no effect, because robot.tf is none",
     "robot.tf=own"),
    (("middleware={model: ros1, polled_topics: 3}",), "middleware.polled_topics: no effect, "
     "because middleware.polling is null", "middleware.polling=1 s"),
    (("middleware={model: multimaster, polling: 1 s, polled_topics: 3}",), "middleware.polling, "
     "middleware.polled_topics: no effect, because each process has its master on its own host",
     "middleware={model: ros1, polling: 1 s, polled_topics: 3}"),
    (("robot.localization={model: gmapping, map_period: 3 s}",), "robot.localization.map_period: "
     "no effect, because maps go to the robot where SLAM runs on another host "
     "(localization.host)", "robot.localization.host=workstation"),
    (("robot.navigation={local: regulated_pure_pursuit, sim_time: 2 s, constants: "
      "{keep_right: 0 m}}",), "robot.navigation.sim_time, robot.navigation.constants.keep_right: "
     "no effect, because only the local planner dynamic_window reads them "
     "(robot.navigation.local)", "robot.navigation.local=dynamic_window"),
    (("robot.mapping.published_size=[20 m, 20 m]",), "robot.mapping.published_size: no effect, "
     "because the terrain's own map is no smaller, 121 x 121 cells",
     "robot.mapping.published_size=[30 m, 30 m]"),
    (("deployment=field", "network.media.usb={model: link, inside: true, hosts: [base]}",
      "hosts.base={}", "topics={scan: {medium: usb}}"), "network.media.usb: no effect, because no "
     "topic of the run took it inside a host (topics)", "network.media.usb.hosts=[robot_0]"),
    (("network.media.usb={model: link, inside: true}",), "network.media.usb: no effect, because no "
     "topic of the run took it inside a host (topics); in a testbed the sensors are on the "
     "workstation", FIELD_WITH_BUS),
    ((OTHERS, "network.background=[]"), "network.others.nas: no effect, because no flow of "
     "network.background begins or ends there", FLOW.format("on_off")),
    ((OTHERS, FLOW.format("poisson")), "network.background.0.on, network.background.0.off: no "
     "effect, because only pattern: on_off has spells", FLOW.format("on_off")),
    (("robot.exploration.publishes_cost=true", "deployment=field"), "robot.exploration."
     "publishes_cost: no effect, because no host collects it (hosts.<name>.monitor)",
     "hosts.base={monitor: true}"),
    (("measure.when=['collisions > 3', 'max_ram_percent > 90']", SAYS), "measure.when.1: no "
     "effect, because max_ram_percent is unknown where no host's memory has a limit "
     "(computer.memory)", "robot.computer.memory=1 GB"),
    (("measure.periods={cpu_percent: 1 s, explored: 1 s, robots: 2 s, bytes_per_s: 1 s}",),
     "measure.periods.cpu_percent: no effect, because the run does not measure it", SAYS)])
def test_keys_without_effect_are_said(overrides, line, twin):
    assert said(*overrides) == [line]
    assert said(*overrides, *([twin] if isinstance(twin, str) else twin)) == []


def test_a_type_may_use_what_it_has_from_the_fleet():
    fleet = "robot.computer.priorities={move_base: 1}"
    own = "fleet.types={own: {robot: {computer: {scheduling: fixed_priority}}}}"
    assert said(SAYS, fleet, own) == []
    assert len(said(SAYS, fleet)) == 1


def test_the_period_of_messages_to_a_monitor_counts_for_any_monitor():
    base = "hosts.base={at: [0 m, 0 m], monitor: true}"
    assert said("testbed.monitor_period=2 s", "deployment=field", base) == []
    assert len(said("testbed.monitor_period=2 s", "deployment=field")) == 1


PLACES = "places: [[-10 m, 10 m], [-4 m, 10 m]]"


@pytest.mark.parametrize(("overrides", "lines", "twin"), [
    ((f"task={{model: patrolling, {PLACES}, drawn: 9, clearance: 2 m}}",),
     ["task.drawn, task.clearance: no effect, because task.places are given, and none is drawn"],
     "task.places=null"),
    (("task=patrolling", "stop.explored=90 %", "stop.by=all"),
     ["stop.explored, stop.by: no effect, because they end the task exploration, and the task is "
      "patrolling"], "task=exploration")])
def test_keys_of_another_task_or_of_another_way_to_find_places_are_said(overrides, lines, twin):
    assert said(*overrides) == lines
    assert said(*overrides, twin) == []


def test_a_plug_in_from_outside_says_which_of_its_keys_had_no_effect():
    lan = (f"network.media.lan={{model: switch, rules: [{{rule: '{leaky_rule.__file__[:-3]}:Leaky',"
           " first: 3%s}]}")
    assert said(lan % "") == ["network.media.lan.rules.0.first: no effect, because nth is 0"]
    assert said(lan % ", nth: 2") == said(lan.replace("3", "1") % "") == []


def test_the_check_of_plug_ins_finds_keys_that_there_are_not():
    check_rule(leaky_rule.Leaky, first=3)
    with pytest.raises(AssertionError, match=r"\.nth, \.first, .*not '\.second'"):
        check_rule(leaky_rule.Misspelt, first=3)
