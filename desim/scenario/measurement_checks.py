"""The checks of what is measured, and of what ends a run."""

from __future__ import annotations

from collections.abc import Callable, Collection

from desim import plugins
from desim.errors import InputError, did_you_mean
from desim.ports.tasks import TaskTraits
from desim.scenario import expression
from desim.scenario.checks import Checks, Found
from desim.scenario.quantities import ROBOTS, ROBOTS_TABLE, measurements, not_measured, quantities
from desim.scenario.schema.scenario import Scenario
from desim.scenario.source_places import Folder, Path
from desim.units import DURATION, NS_PER_S


def _expressions(scenario: Scenario, _: Folder) -> Found:
    """Those of stop and measure."""
    try:
        names = quantities(scenario, _measured(scenario))
    except InputError:
        return  # there is no such task, which is complained of where it is named
    written: list[tuple[Path, str, Callable[[str, Collection[str]], object], Collection[str]]] = [
        *((("measure", "when", i), text, expression.of_quantities, names)
          for i, text in enumerate(scenario.measure.when)),
        (("measure", "cost"), scenario.measure.cost, expression.number, (*names, ROBOTS))]
    if scenario.stop.when is not None:
        written.insert(0, (("stop", "when"), scenario.stop.when, expression.condition, names))
    for path, text, read, known in written:
        complaint = not_measured(scenario, text)
        if complaint:
            yield path, complaint
            continue
        try:
            read(text, known)
        except InputError as error:
            yield path, str(error)


def _periods(scenario: Scenario, _: Folder) -> Found:
    """Those of single measurements."""
    try:
        known = measurements(_measured(scenario))
    except InputError:
        return  # as above
    for name in scenario.measure.periods:
        if name not in known:
            yield ("measure", "periods", name), (
                f"unknown measurement {name!r}{did_you_mean(name, known)}; allowed: "
                f"{', '.join(known)}")
        elif name == ROBOTS_TABLE and scenario.measure.periods[name] % NS_PER_S:
            yield ("measure", "periods", name), (
                "must be whole seconds, got "
                f"{DURATION.format(scenario.measure.periods[name])}")


def _measured(scenario: Scenario) -> tuple[str, ...]:
    """The quantities that the task has of its own."""
    return TaskTraits.of(plugins.load("task", scenario.task.model)).quantities


CHECKS: Checks = (
    ((("stop", "when"), ("measure", "when"), ("measure", "cost"), ("task",), ("robot", "power"),
      ("fleet",), ("computers",)), _expressions),
    ((("measure", "periods"), ("task",)), _periods),
)
