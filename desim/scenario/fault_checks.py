"""The checks of faults, and of robots that are passive."""

from __future__ import annotations

from desim.scenario.checks import Checks, Found
from desim.scenario.names import access_point_names, host_names, robot_names, unknown
from desim.scenario.schema.communication import Fault
from desim.scenario.schema.scenario import Scenario
from desim.scenario.source_places import Folder
from desim.units import DURATION


def _known_names(scenario: Scenario, _: Folder) -> Found:
    hosts = host_names(scenario) if scenario.faults else ()
    points = access_point_names(scenario) if scenario.faults else {}
    for i, fault in enumerate(scenario.faults):
        what, known = ("robot", robot_names(scenario)) if fault.kind == "stuck" else ("host", hosts)
        if fault.host in points:
            if fault.kind != "stop":
                yield ("faults", i, "kind"), (
                    "an access point has no software and no drive; allowed: stop")
            if len(points[fault.host]) > 1:
                yield ("faults", i, "host"), (
                    f"{' and '.join(points[fault.host])} have an access point {fault.host} each; "
                    "allowed: one of a single medium")
        elif fault.host not in known:
            if fault.kind == "stop":
                known = (*known, *points)
            yield ("faults", i, "host"), unknown(what, fault.host, known)
    robots = robot_names(scenario) if scenario.robot.passive else ()
    for i, name in enumerate(scenario.robot.passive):
        if name not in robots:
            yield ("robot", "passive", i), unknown("robot", name, robots)


def _faults(scenario: Scenario, _: Folder) -> Found:
    """Faults of one host or of one drive come one after the other."""
    before: dict[tuple[str, bool], tuple[int, Fault]] = {}
    # sorted by time; where two begin together the one that is written later is wrong
    for i, fault in sorted(enumerate(scenario.faults), key=lambda item: item[1].at_ns):
        number, earlier = before.get((fault.host, fault.kind == "stuck"), (None, None))
        begins, has = _VERBS[fault.kind]
        if earlier is not None and not _over(earlier, fault.at_ns):
            until = ("for good" if earlier.down_for_ns is None else
                     f"until {DURATION.format(earlier.at_ns + earlier.down_for_ns)}")
            yield ("faults", i), (
                f"{fault.host} is to {begins} at {DURATION.format(fault.at_ns)}, but "
                f"faults.{number} {has} it at {DURATION.format(earlier.at_ns)} {until}; allowed: "
                "one after the other")
        if earlier is None or _over(earlier, fault.at_ns):
            before[fault.host, fault.kind == "stuck"] = i, fault


_VERBS = {"stop": ("stop", "has stopped"), "software": ("lose its software", "has stopped"),
          "stuck": ("be stuck", "holds")}


def _over(fault: Fault, time_ns: int) -> bool:
    """Whether the host has started again before ``time_ns``."""
    return fault.down_for_ns is not None and fault.at_ns + fault.down_for_ns < time_ns


CHECKS: Checks = (
    ((("fleet",), ("hosts",), ("deployment",), ("faults",), ("robot", "passive")), _known_names),
    ((("faults",),), _faults),
)
