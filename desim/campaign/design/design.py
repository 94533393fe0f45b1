"""A design: the paper's Table 4 as a file, on top of one scenario.

Its parts are parameters, vectors, iterations, stop conditions, measurements and metrics. Errors
carry the place in the file, as those of scenarios do: ``design.yaml:7:12: parameters...``.
"""

from __future__ import annotations

import os
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Annotated, Literal

from pydantic import Field

from desim import plugins
from desim.errors import InputError
from desim.ports import Params
from desim.scenario import merge
from desim.scenario.complaints import lines, validated
from desim.scenario.load import scenario_document
from desim.scenario.schema.shapes import BY_SHAPE
from desim.scenario.source_places import Path, Places, dotted
from desim.units import Duration

_OF_SCENARIOS = ("environment", "fleet", "robot", "network", "middleware", "coordination",
                 "deployment")
MOST_RUNS = 1_000_000  # their index has up to 4 GB, and is read at once
Name = Annotated[str, Field(pattern=r"^[A-Za-z][A-Za-z0-9_]{0,59}$")]
_KEY = "the scenario's key that it sets, e.g. fleet.size; null: others use it as $name"


class Values(Params):
    """A parameter by its values."""

    key: str | None = Field(None, description=_KEY)
    values: tuple[object, ...] = Field((), description=(
        "as the scenario has them; none: the vectors name them"))


class Levels(Params):
    """A parameter by named settings, each of several keys of the scenario."""

    levels: dict[str, dict[str, object]] = Field(description=(
        "name to keys and values, e.g. {far: {network.media.air.power: 20 dBm}}"))


class Span(Params):
    """A parameter by a range, both ends included."""

    key: str | None = Field(None, description=_KEY)
    from_: object = Field(alias="from", description="the first value, e.g. 5 m")
    to: object = Field(description="the last value, in the same unit")
    step: object = Field(None, description="from one value to the next (1 between whole numbers)")
    count: int | None = Field(None, ge=2, le=10_000, description="or how many values there are")
    scale: Literal["linear", "log"] = Field("linear", description=(
        "log: each is the same multiple of the one before; needs count"))


class Function(Params):
    """Vectors from Python."""

    function: str = Field(description="'package.module:function', without arguments: mappings from "
                                      "parameter to value")


class LatinHypercube(Params):
    """Samples that fill each parameter's range evenly (McKay, Beckman and Conover 1979)."""

    latin_hypercube: int = Field(ge=1, le=MOST_RUNS, description="how many")


class Sobol(Params):
    """The first points of a scrambled Sobol sequence (Owen 1998)."""

    sobol: int = Field(ge=1, le=MOST_RUNS, description=(
        "how many; a power of two keeps them balanced"))


class Saltelli(Params):
    """Points for sensitivity indices: n (d + 2) of them with d parameters (Saltelli et al. 2010).
    """

    saltelli: int = Field(ge=2, le=MOST_RUNS, description="n, a power of two")


class Until(Params):
    """Iterations until a metric is known well enough."""

    metric: str = Field(description="whose 95 % interval is looked at, vector by vector")
    width: object = Field(description="of the interval at most, e.g. '10 %' of the mean, or 12.5")
    at_least: int = Field(5, ge=2, description="iterations (the paper repeats 5 times)")
    at_most: int = Field(50, ge=2, description="iterations")


class Limits(Params):
    """The most that a run may cost before it is given up."""

    wall_ns: Duration | None = Field(None, description=(
        "clock time of one run, e.g. 10 min: a worker that is at it for longer is ended, and the "
        "run has failed (null: as long as it takes)"))


class Presentation(Params):
    """The metrics and parameters that the report shows first; its tables have everything."""

    metrics: tuple[str, ...] = Field((), min_length=1, validate_default=False, description=(
        "in this order; *_delivered draws all of the design's own that match in one figure "
        "(default: those that lead the task, of exploration exploration_time_s)"))
    against: str | None = Field(None, description=(
        "the parameter along the axis (null: the first with numbers)"))
    by: str | None = Field(None, description="the parameter that tells the lines apart (null: the "
                                             "next one)")


class Reference(Params):
    """The mark of a reference design, whose results the leaderboard compares."""

    version: int = Field(ge=1, description=(
        "of the design; raise it with every change after which results do not compare with those "
        "of before"))


class Design(Params):
    """One question, and the runs that answer it."""

    name: str = Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9_.-]{0,99}$")
    question: str = Field("", description="in words; the report begins with it")
    base: str = Field(description="a scenario's YAML file, relative to this one")
    set: dict[str, object] = Field({}, description=(
        "keys of the scenario and their values in every run, e.g. {stop.elapsed: 600 s}"))
    parameters: dict[Name, Annotated[Values | Levels | Span, BY_SHAPE]] = Field({}, description=(
        "by name; a later one is laid over an earlier one"))
    vectors: Annotated[str | tuple[dict[str, object], ...] | Function | LatinHypercube | Sobol |
                       Saltelli, BY_SHAPE] = Field("all", description=(
        "which combinations of values are run: all; zip (the first of each, the second of each, "
        "...); a list of mappings; a function; or samples"))
    iterations: Annotated[int | Until, BY_SHAPE] = Field(10, description=(
        "runs of each vector (the paper has 5; of 5 runs a t interval can hold the mean in 66 % "
        "instead of 95 %), or until a metric is known well enough"))
    seed: int = Field(1, ge=0, le=2**62, description="of the first iteration; the next one has the "
                                                     "next seed")
    random_numbers: Literal["common", "independent"] = Field("common", description=(
        "common: iteration k has the same seed in every vector, so that differences between "
        "vectors are not chance; independent: each run its own"))
    stop: dict[str, object] = Field({}, description="stop conditions, laid over the scenario's")
    measure: dict[str, object] = Field({}, description="measurements, laid over the scenario's")
    limits: Limits = Field(default_factory=Limits, description="of each run")
    metrics: dict[Name, str] = Field({}, description=(
        "your own, beside those of summary.json: an expression over these, or "
        "'package.module:function' of a desim.Run"))
    report: Presentation = Field(default_factory=Presentation)
    reference: Reference | None = Field(None, description=(
        "a reference design by its version: desim report --leaderboard takes its results (null: "
        "none; one that extends it is none either, unless it says so itself)"))


def led_by(design: Design, tasks: Iterable[str]) -> Design:
    """The design whose report shows what leads ``tasks``, unless it names metrics itself."""
    if design.report.metrics:
        return design
    leads = dict.fromkeys(name for task in tasks for name in plugins.load("task", task).leads)
    return design.model_copy(update={"report": design.report.model_copy(
        update={"metrics": tuple(leads)})})


@dataclass(frozen=True)
class LoadedDesign:
    """A design, the scenario under it, and where each part was written."""

    design: Design
    places: Places
    base: merge.Document
    file: str

    def folder(self, path: Path) -> str:
        """The folder of the file in which the value at ``path`` was written: with ``extends`` there
        are several files. Empty for a value of the command line."""
        place = self.places.value(path)
        return os.path.dirname(place.source) if place.line else ""

    def wrong(self, path: Path, text: str) -> InputError:
        """An error about what stands at ``path`` of the design."""
        return InputError(f"{self.places.value(path)}: {dotted(path)}: {text}")


def load_design(path: str | os.PathLike) -> LoadedDesign:
    """The design in a YAML file, which may extend another one, as scenarios do. Raises
    ``InputError`` with a line for each mistake. Its scenarios are checked when its runs are
    planned."""
    file = os.fspath(path)
    design, places = read_design(file)
    folder = os.path.dirname(places.value(("base",)).source)
    base = os.path.normpath(os.path.join(folder, design.base))
    if not os.path.isfile(base):
        raise InputError(f"{places.where('base')}: no such file: {base}")
    return LoadedDesign(design, places, scenario_document(base), file)


def read_design(file: str) -> tuple[Design, Places]:
    """The design in a file by itself, whether or not its base is there. Raises ``InputError``."""
    data, places = merge.extended(file)
    if places.key(("reference",)).source != places.root.source:  # the extended design's
        data.pop("reference", None)
    if "base" not in data and any(family in data for family in _OF_SCENARIOS):
        raise InputError(f"{file}: this is a scenario, of one run: desim run {file}; a design has "
                         f"a base and parameters; desim sweep {file} --vary fleet.size=4,8 needs "
                         "none")
    design = validated(Design, data)
    if isinstance(design, list):
        raise InputError(*lines(design, places))
    return design, places
