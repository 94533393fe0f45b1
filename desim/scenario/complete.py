"""Defaults that depend on other values, filled in: afterwards a scenario spells out everything."""

from __future__ import annotations

import os
from typing import TypeVar, get_args

from desim import plugins
from desim.ports import Params, StrategyTraits, natural_key
from desim.ports.local_planners import LocalPlannerTraits
from desim.ports.sharing import SharingTraits
from desim.scenario import plugin_choices
from desim.scenario.cluster_nodes import cluster_nodes
from desim.scenario.names import fleet_size, robot_names
from desim.scenario.recipients import monitors, words_of
from desim.scenario.robot_types import (
    equipment_by_path,
    filled_in,
    strategies_of,
    types_by_name,
    used_types,
)
from desim.scenario.schema.communication import (
    Coordination,
    MediumChoice,
    Network,
    TeamStateParams,
)
from desim.scenario.schema.environment import BUILT_IN_TERRAINS, Environment, MapFile
from desim.scenario.schema.experiment import TaskChoice
from desim.scenario.schema.fleet import FleetParams, RobotType, StartList
from desim.scenario.schema.footprint import radii_m
from desim.scenario.schema.loop import Loop
from desim.scenario.schema.robot import Equipment, laser_of
from desim.scenario.schema.scenario import Scenario
from desim.scenario.source_places import Data, Folder

P = TypeVar("P", bound=Params)
E = TypeVar("E", bound=Equipment)
T = TypeVar("T")

# The paper's testbed is a switched Gigabit LAN. In the field: what a robot of 2020 to 2024 has.
_MEDIA = {"testbed": {"lan": MediumChoice(model="switch")},
          "field": {"air": MediumChoice(model="radio", card="pi_4", preset="indoor")}}
_EXCHANGE = {"testbed": {"content": "full", "encoding": "raw"},  # where it has these parameters
             "field": {"content": "changed_tiles", "encoding": "zlib"}}


def complete(scenario: Scenario, folder: Folder) -> Scenario:
    """The scenario with nothing left to be decided. It must have passed all checks."""
    receivers = monitors(scenario)
    robot = _parsed(_equipment(scenario.robot, receivers))
    return _changed(
        scenario,
        environment=_environment(scenario.environment, folder),
        fleet=_fleet(scenario, robot, receivers),
        robot=_changed(robot, passive=_passive(scenario)),
        network=_network(scenario),
        topics={pattern: _changed(choice, medium=choice.media)
                for pattern, choice in scenario.topics.items()},
        hosts={name: host.parsed() for name, host in _sorted(scenario.hosts).items()},
        middleware=scenario.middleware.parsed(),
        computers=scenario.computers.parsed(),
        task=_task(scenario).parsed(),
        coordination=_coordination(scenario).parsed(),
        loop=_loop(scenario.loop, folder),
    )


def _passive(scenario: Scenario) -> tuple[str, ...]:
    """The robots without software of desim: also those with real programs, unless these only send
    goals."""
    programs = (() if scenario.loop.navigation
                else scenario.loop.hosts.intersection(robot_names(scenario)))
    return tuple(sorted({*scenario.robot.passive, *programs}, key=natural_key))


def _loop(loop: Loop, folder: Folder) -> Loop:
    """Programs with absolute folders."""
    return _changed(loop, programs=tuple(
        _changed(program, folder=os.path.abspath(os.path.join(
            folder(("loop", "programs", number)), program.folder)))
        for number, program in enumerate(loop.programs)))


def _task(scenario: Scenario) -> TaskChoice:
    return scenario.task if fleet_size(scenario.fleet) else TaskChoice(model="none")


def _environment(environment: Environment, folder: Folder) -> Environment:
    """Maps by their absolute path."""
    terrain = environment.terrain
    if isinstance(terrain, str) and terrain not in BUILT_IN_TERRAINS:
        terrain = MapFile(map=terrain)
    if isinstance(terrain, MapFile):
        path = os.path.abspath(os.path.join(folder(("environment", "terrain")), terrain.map))
        terrain = _changed(terrain, map=path)
    return _changed(environment, terrain=terrain)


def _fleet(scenario: Scenario, equipment: Equipment, receivers: tuple[str, ...]) -> FleetParams:
    """The size, and all types that are used, with what they carry and run; named start poses in the
    order of their names."""
    fleet, known = scenario.fleet, types_by_name(scenario)
    types = {name: _type(known[name], equipment, receivers)
             for name in (*fleet.types, *used_types(fleet))}
    start = fleet.start
    if isinstance(start, StartList) and start.poses[0].name:
        start = _changed(start, poses=tuple(sorted(start.poses,
                                                   key=lambda pose: natural_key(pose.name or ""))))
    return _changed(fleet, size=fleet_size(fleet), start=start,
                    types=_sorted(types))


def _type(kind: RobotType, equipment: Equipment, receivers: tuple[str, ...]) -> RobotType:
    if kind.footprint:
        kind = _changed(kind, radius_m=radii_m(kind.footprint)[1])
    if kind.robot is not None:
        kind = _changed(kind, robot=_parsed(filled_in(_equipment(kind.robot, receivers),
                                                         equipment)))
    return kind.parsed()


def _equipment(robot: E, receivers: tuple[str, ...]) -> E:
    """Lasers by their parameters. Who has several lasers has not the only one, and the other way
    round. What is published goes to ``receivers``, where nothing is said."""
    if robot.publishes:
        robot = _changed(robot, publishes=tuple(
            _changed(one, to=words_of(one) or receivers) for one in robot.publishes))
    if robot.lasers:
        return _changed(robot, laser=None, lasers={name: laser_of(laser) for name, laser
                                                   in robot.lasers.items()})
    if "laser" in robot.model_fields_set:
        return _changed(robot, laser=robot.first_laser, lasers={})
    return robot


def _parsed(robot: E) -> E:
    """The values of the parameters of its plug-ins, too."""
    navigation = robot.navigation
    return _changed(robot, localization=robot.localization.parsed(),
                    navigation=_changed(navigation, local=navigation.local.parsed()))


def media(scenario: Scenario) -> dict[str, MediumChoice]:
    """Those of the scenario, or of its deployment if it names none."""
    own = scenario.network.media
    if all(medium.inside for medium in own.values()):
        return {**_given(scenario.deployment), **own}
    return own


def _given(deployment: object) -> dict[str, MediumChoice]:
    """The media of a deployment if nobody names any."""
    return _MEDIA["field" if deployment == "field" else "testbed"]


def lay_on_given_media(data: Data) -> None:
    """Lay what is written of a medium without a model, ``{lan: {rate: 1 Mb/s}}``, over the medium
    of that name which the deployment gives."""
    network = data.get("network")
    if not isinstance(network, dict) or not isinstance(own := network.get("media"), dict):
        return
    for name, given in _given(data.get("deployment")).items():
        if isinstance(own.get(name), dict) and "model" not in own[name]:
            own[name] = {**given.model_dump(exclude_unset=True), **own[name]}


def _network(scenario: Scenario) -> Network:
    fidelity = scenario.network.fidelity
    own = {name: medium if fidelity is None or not plugin_choices.has_fidelity(medium)
           else _changed(medium, fidelity=fidelity)
           for name, medium in sorted(media(scenario).items(), key=lambda item: (
               item[1].metric, natural_key(item[0])))}
    if scenario.deployment == "testbed":
        own = {name: medium if medium.inside else _in_testbed(medium, scenario)
               for name, medium in own.items()}
    return _changed(scenario.network, media={name: medium.parsed() for name, medium in own.items()},
                    others=_sorted(scenario.network.others))


def _in_testbed(medium: MediumChoice, scenario: Scenario) -> MediumChoice:
    """Interfaces of the paper's time, and ports that the robots' virtual machines share, one for
    each cluster node; where the model has such parameters and the scenario does not set them."""
    fields = plugins.parameters("network", medium.model).model_fields
    free = fields.keys() - medium.written.keys()
    # Linux had pfifo_fast (fq_codel is the default of distributions since 2015).
    if "queue" in free and "pfifo" in get_args(fields["queue"].annotation):
        medium = _changed(medium, queue="pfifo")
    if "ports" not in free:
        return medium
    return _changed(medium, ports={node: list(robots)
                                   for node, robots in cluster_nodes(scenario).items()})


def _coordination(scenario: Scenario) -> Coordination:
    coordination = scenario.coordination
    if "team_state" not in coordination.model_fields_set and (any(
            StrategyTraits.of(plugins.load("strategy", choice.strategy)).reads_team_state
            for choice in strategies_of(scenario)) or any(
            LocalPlannerTraits.of(plugins.load("local_planner", robot.navigation.local.model))
            .follows_neighbours for _, robot in equipment_by_path(scenario))):
        coordination = _changed(coordination, team_state=TeamStateParams())
    exchange = coordination.exchange
    if exchange is None:
        return coordination
    free = (plugins.parameters("sharing", exchange.model).model_fields.keys()
            - exchange.written.keys())
    missing = {key: value for key, value in _EXCHANGE[scenario.deployment].items() if key in free}
    if exchange.fusion is None:
        missing["fusion"] = SharingTraits.of(plugins.load("sharing", exchange.model)).fusion
    return _changed(coordination, exchange=_changed(exchange, **missing))


def _sorted(by_name: dict[str, T]) -> dict[str, T]:
    return {name: by_name[name] for name in sorted(by_name, key=natural_key)}


def _changed(params: P, **update: object) -> P:
    return params.model_copy(update=update)
