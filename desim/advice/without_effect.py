"""Keys of a scenario that had no effect on its run, because of the value of another key."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import Any, NamedTuple

from desim.middleware.graph import Graph
from desim.monitor.monitor import Monitor
from desim.ports import GridSpec, KnowsUnusedKeys, Params, ReadsMarks, changed_keys, yaml_key
from desim.scenario.plugin_choices import chosen
from desim.scenario.quantities import ROBOTS_TABLE
from desim.scenario.recipients import monitors
from desim.scenario.robot_types import equipment_by_path
from desim.scenario.schema.communication import MediumChoice
from desim.scenario.schema.computer import ComputerParams, WorkstationComputer
from desim.scenario.schema.navigation import Navigation
from desim.scenario.schema.power import ComputerPower
from desim.scenario.schema.robot import ExplorationParams, LocalizationChoice
from desim.scenario.schema.scenario import Scenario, Testbed

Found = Iterator[tuple[Sequence[str], str]]  # keys, and why they had no effect


class Block(NamedTuple):
    """The parameters at ``path``, and the ``usual`` ones: the defaults, or for a type of robots
    those of the fleet."""

    path: str
    own: Any
    usual: Any


def without_effect(monitor: Monitor) -> list[str]:
    """A warning for each reason, with the keys whose value is not the default. (A run's resolved
    scenario has all keys, so which of them somebody wrote is not known.)"""
    truth, scenario = monitor.truth, monitor.truth.scenario
    ideal = all(host.computer is None for host in truth.graph.hosts)
    found = (*(_of_ideal_computers(scenario) if ideal else _of_computers(scenario, monitor)),
             *_of_testbed(scenario, ideal), *_of_networks(scenario, truth.graph),
             *_of_maps(scenario, truth.ground.grid), *_of_rollouts(scenario),
             *_of_measurements(scenario, monitor),
             *_of_plugins(scenario))
    return [f"{', '.join(keys)}: no effect, because {why}" for keys, why in found if keys]


def _of_ideal_computers(scenario: Scenario) -> Found:
    yield ([*_changed(_computers(scenario), *ComputerParams.model_fields),
            *_changed(_powers(scenario), "processor_w"),
            *(_own("testbed", scenario.testbed, "processors_per_node") if _is_testbed(scenario)
              else ())],
           "callbacks take neither time nor memory with computers: ideal")


def _of_computers(scenario: Scenario, monitor: Monitor) -> Found:
    blocks = _computers(scenario)
    yield (_unused(blocks, "priorities", lambda own: own.scheduling == "fixed_priority"),
           "priorities count only with scheduling: fixed_priority")
    yield (_unused(blocks, "respawn_delay_ns", lambda own: own.memory_bytes is not None),
           "software dies only where memory has a limit")
    if not any(own["peak_ram_mb"] for own in monitor.by_host().values()):
        yield (_changed(blocks, "memory_bytes"),
               f"nothing takes memory with computers: {scenario.computers.model}")


def _of_testbed(scenario: Scenario, ideal: bool) -> Found:
    testbed = scenario.testbed
    if not _is_testbed(scenario):
        # Any host may be a monitor.
        period = ("monitor_period_ns",) if monitors(scenario) else ()
        yield (_own("testbed", testbed, *(name for name in Testbed.model_fields
                                          if name not in period)),
               f"deployment is {scenario.deployment}")
        return
    if ideal and not any(hasattr(medium.params, "ports")
                         for medium in scenario.network.media.values()):
        yield (_own("testbed", testbed, "robots_per_node"),
               "robots on a node share neither processors (computers: ideal) nor a port (no medium "
               "has any)")
    if scenario.robot.tf == "none":
        yield _own("testbed.processes", testbed.processes, "tf"), "robot.tf is none"


def _of_networks(scenario: Scenario, graph: Graph) -> Found:
    network = scenario.network
    taken = {medium.name.partition("@")[0] for medium in graph.inside if medium.intended}
    yield ([f"network.media.{name}" for name, choice in network.media.items()
            if choice.inside and name not in taken],
           "no topic of the run took it inside a host (topics)" + (
               "; in a testbed the sensors are on the workstation" if _is_testbed(scenario) else
               ""))
    ends = {end for flow in network.background for end in flow.between}
    yield ([f"topics.{pattern}.dscp" for pattern, choice in scenario.topics.items()
            if choice.dscp and not any(_reads_marks(network.media[name])
                                       for name in choice.media or network.media)],
           "no medium of theirs has access categories (a radio has them since 802.11n, or with "
           "qos: true)")
    yield ([f"network.others.{name}" for name in network.others if name not in ends],
           "no flow of network.background begins or ends there")
    yield ([key for i, flow in enumerate(network.background) if flow.pattern != "on_off"
            for key in _own(f"network.background.{i}", flow, "on_ns", "off_ns")],
           "only pattern: on_off has spells")


def _reads_marks(choice: MediumChoice) -> bool:
    return isinstance(choice.params, ReadsMarks) and choice.params.reads_marks


def _of_maps(scenario: Scenario, grid: GridSpec) -> Found:
    slam = _equipment(scenario, "localization", LocalizationChoice())
    yield (_unused(slam, "map_period_ns", lambda own: own.host is not None),
           "maps go to the robot where SLAM runs on another host (localization.host)")
    mapping = scenario.robot.mapping
    if not mapping.padding(grid.width * grid.height):
        yield (_own("robot.mapping", mapping, "published_size_m"),
               f"the terrain's own map is no smaller, {grid.width} x {grid.height} cells")


def _of_rollouts(scenario: Scenario) -> Found:
    blocks = _equipment(scenario, "navigation", Navigation())
    if all(own.local.model != "dynamic_window" for _, own, _ in blocks):
        constants = [Block(f"{path}.constants", own.constants, usual.constants)
                     for path, own, usual in blocks]
        yield ([*_changed(blocks, "sim_time_ns", "speed_samples", "turn_samples"),
                *_changed(constants, "keep_right_m", "path_weight", "goal_weight",
                          "obstacle_weight")],
               "only the local planner dynamic_window reads them (robot.navigation.local)")


def _of_measurements(scenario: Scenario, monitor: Monitor) -> Found:
    measured = {ROBOTS_TABLE, *(name for sample in monitor.samples for name in sample)}
    yield ([f"measure.periods.{name}" for name in scenario.measure.periods
            if name not in measured], "the run does not measure it")
    if not any(own.memory_bytes for _, own, _ in _computers(scenario)):
        yield (_naming(scenario, "max_ram_percent"),
               "max_ram_percent is unknown where no host's memory has a limit (computer.memory)")
    if not monitors(scenario):
        costs = _equipment(scenario, "exploration", ExplorationParams())
        yield (_changed(costs, "publishes_cost"), "no host collects it (hosts.<name>.monitor)")


def _naming(scenario: Scenario, quantity: str) -> list[str]:
    """The keys of conditions that name ``quantity``."""
    conditions = {"stop.when": scenario.stop.when or "",
                  **{f"measure.when.{i}": text for i, text in enumerate(scenario.measure.when)}}
    return [key for key, text in conditions.items() if quantity in text]


def _of_plugins(scenario: Scenario) -> Found:
    """The keys that plug-ins know of, in their own blocks and elsewhere."""
    for path, choice in chosen(scenario):
        if isinstance(choice.params, KnowsUnusedKeys):
            for keys, why in choice.params.without_effect(scenario):
                yield [f"{path}{key}" if key.startswith(".") else key for key in keys], why


def _is_testbed(scenario: Scenario) -> bool:
    return scenario.deployment == "testbed"


def _own(path: str, block: Params, *fields: str) -> list[str]:
    """The keys of a block at ``path`` whose value is not the default."""
    return [f"{path}{key}" for key in changed_keys(block, *fields)]


def _equipment(scenario: Scenario, part: str, default: Params) -> list[Block]:
    """A part of the robots' equipment; the types of robots inherit the fleet's."""
    return [Block(f"{'.'.join(map(str, path))}.{part}", getattr(equipment, part),
                  default if equipment is scenario.robot else getattr(scenario.robot, part))
            for path, equipment in equipment_by_path(scenario)]


def _computers(scenario: Scenario) -> list[Block]:
    """The computers of robots, of the workstation and of stationary hosts."""
    default = ComputerParams()
    workstation = [Block("testbed.computer", scenario.testbed.computer, WorkstationComputer())]
    return [*_equipment(scenario, "computer", default),
            *(workstation if _is_testbed(scenario) else ()),
            *(Block(f"hosts.{name}.computer", host.computer, default)
              for name, host in scenario.hosts.items())]


def _powers(scenario: Scenario) -> list[Block]:
    """The power of robots' computers, where it is given."""
    default, fleet = ComputerPower(), scenario.robot.power
    return [Block(f"{'.'.join(map(str, path))}.power.computer", equipment.power.computer,
                  default if fleet is None or equipment is scenario.robot else fleet.computer)
            for path, equipment in equipment_by_path(scenario) if equipment.power is not None]


def _changed(blocks: Sequence[Block], *names: str) -> list[str]:
    """The keys of ``names`` whose value is not the usual one."""
    return [key for name in names for key in _unused(blocks, name, lambda _: False)]


def _unused(blocks: Sequence[Block], name: str, uses: Callable[[Any], bool]) -> list[str]:
    """The keys ``name`` whose value is not the usual one, unless a block with the same value
    ``uses`` it. (A type of robots inherits the fleet's value, and may be the one that uses it.)"""
    used = [getattr(own, name) for _, own, _ in blocks if uses(own)]
    return [f"{path}.{yaml_key(name)}" for path, own, usual in blocks
            if getattr(own, name) != getattr(usual, name) and getattr(own, name) not in used]
