"""Checks of the real programs of a scenario."""

from __future__ import annotations

import os
import re

from desim.scenario.checks import Checks, Found
from desim.scenario.names import robot_names, unknown
from desim.scenario.schema.scenario import Scenario
from desim.scenario.source_places import Folder


def _hosts(scenario: Scenario, _: Folder) -> Found:
    robots = robot_names(scenario) if scenario.loop.programs else ()
    known = (*robots, *scenario.hosts)
    for number, program in enumerate(scenario.loop.programs):
        path, name = ("loop", "programs", number, "host"), program.host
        if name not in known:
            yield path, unknown("host", name, known)
        elif name in robots and scenario.deployment == "testbed":
            yield path, (f"in a testbed the computer of {name} has no sensors and motors; allowed: "
                         "one of hosts, or a robot with deployment: field")
        elif name in scenario.hosts and scenario.hosts[name].strategy is not None:
            yield path, f"{name} runs a strategy of desim; allowed: a host without software"
    master = scenario.loop.ros_master
    if master is not None and not scenario.loop.programs:
        yield ("loop", "ros_master"), (f"{master} runs no ROS master, as loop.programs is empty; "
                                       "allowed: a host of one of them")
    elif master is not None and master not in scenario.loop.hosts:
        yield ("loop", "ros_master"), unknown("host with programs", master,
                                              sorted(scenario.loop.hosts))
    if scenario.loop.navigation and master is None and scenario.loop.dds_domain is None:
        yield ("loop", "navigation"), ("robots have no topics on which programs send goals; "
                                       "allowed: false, or with ros_master or dds_domain")


def _starts(scenario: Scenario, folder: Folder) -> Found:
    for number, program in enumerate(scenario.loop.programs):
        path = ("loop", "programs", number)
        here = os.path.join(folder((*path, "folder")), program.folder)
        if not os.path.isdir(here):
            yield (*path, "folder"), f"no folder {os.path.abspath(here)}"
        if not program.run.strip():
            yield (*path, "run"), "no command; allowed: what /bin/sh runs"
        for name in program.env:
            if not re.fullmatch(r"[A-Za-z_][A-Za-z0-9_]*", name):
                yield (*path, "env", name), (
                    f"{name!r} is no name of an environment variable; allowed: letters, digits and "
                    "_, no digit first")


CHECKS: Checks = (
    ((("loop",), ("hosts",), ("fleet",), ("deployment",)), _hosts),
    ((("loop", "programs"),), _starts),
)
