"""The plan of a design: the runs that it asks for, with scenarios that are checked in advance."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import cache
from typing import NamedTuple

from desim.campaign.design.design import MOST_RUNS, LoadedDesign, Until, led_by
from desim.campaign.design.file_paths import leaves
from desim.campaign.design.parameters import Level, Setting, parameters_of
from desim.campaign.design.quantities import quantity
from desim.campaign.design.reference import reference_design
from desim.campaign.design.vectors import Combination, combinations
from desim.errors import did_you_mean
from desim.results.identity import Identity, source
from desim.scenario.load import Change, Loaded, Variants
from desim.scenario.names import fleet_size
from desim.scenario.source_places import SourcePlace
from desim.units import NS_PER_S

# Rows of messages are for looking at one run; the digest is the same without them.
_KEEP_NOTHING = Change("trace.keep", "none", SourcePlace("desim sweep"))

_OF_THE_DESIGN = {"name": "runs of all vectors lie in one folder",
                  "seed": "see seed, iterations and random_numbers"}


class Vector(NamedTuple):
    """One combination of values. It has a ``run_id`` for each seed, the ``source`` of the code that
    makes its runs, the size of the fleet, and the simulated time at which its runs end in any case.
    """

    number: int
    levels: Combination
    changes: tuple[Change, ...]
    run_id: Callable[[int], str]
    source: str
    robots: int
    limit_s: float

    def matches(self, only: tuple[str, ...]) -> bool:
        """Whether the vector has one of the wanted levels of each parameter, such as ``robots=8``.
        """
        wanted: dict[str, set[str]] = {}
        for text in only:
            name, _, label = text.partition("=")
            wanted.setdefault(name.strip(), set()).add(label.strip())
        return all(self.levels[name].label in labels for name, labels in wanted.items())


def new_levels(vectors: list[Vector]) -> Iterator[Vector]:
    """The vectors that have a level which none before them has."""
    seen: set[tuple[str, str]] = set()
    for vector in vectors:
        own = {(name, level.label) for name, level in vector.levels.items()}
        if own - seen:
            yield vector
        seen |= own


class Plan:
    """The vectors of a design, and the scenario, seed and id of each run. A vector has
    ``least_iterations`` to ``most_iterations``. ``tasks`` are those of all vectors; what leads them
    is what the ``design``'s report shows, unless it names metrics itself. ``reference``: the
    reference design that it is, if it is one.

    ``checked`` is called with the number of vectors that are checked, and of all. Raises
    ``InputError`` for the first vector whose scenario is wrong.
    """

    def __init__(self, loaded: LoadedDesign, checked: Callable[[int, int], object] | None = None,
                 ) -> None:
        self.loaded, self.design = loaded, loaded.design
        _refuse_iterations(loaded)
        rule = self.design.iterations
        self.least_iterations, self.most_iterations = (
            (rule.at_least, rule.at_most) if isinstance(rule, Until) else (rule, rule))
        parameters = parameters_of(loaded)
        self.parameters = tuple(parameters)
        _refuse_unused(loaded)
        chosen = combinations(loaded, parameters)
        if not chosen:
            raise loaded.wrong(("vectors",), "there are none")
        if len(chosen) * self.most_iterations > MOST_RUNS:
            raise loaded.wrong(("iterations",), f"{len(chosen):,} vectors of "
                               f"{self.most_iterations:,} iterations; at most {MOST_RUNS:,} runs")
        self.vectors: list[Vector] = []
        tasks: dict[str, None] = {}
        self._variants = Variants(loaded.base)
        hashed = cache(source)
        for number, levels in enumerate(chosen):
            changes = _changes(loaded, levels)
            variant = self._variants.of(changes)
            variant.refuse_programs()
            scenario = variant.scenario
            tasks[scenario.task.model] = None
            identity = Identity(scenario, hashed)
            self.vectors.append(Vector(
                number, levels, changes, identity.run_id, identity.source,
                fleet_size(scenario.fleet), scenario.stop.elapsed_ns / NS_PER_S))
            if checked is not None:
                checked(number + 1, len(chosen))
        self.tasks = tuple(tasks)
        self.design = led_by(loaded.design, self.tasks)
        self.loaded = replace(loaded, design=self.design)
        self.reference = reference_design(loaded, tasks, self.scenario(self.vectors[0], 0).scenario)

    def seed(self, vector: Vector, iteration: int) -> int:
        """The seed of a run."""
        if self.design.random_numbers == "common":
            return self.design.seed + iteration
        # By the vector's levels, not by its place: another value changes no other run's seed.
        name = repr((self.design.seed, iteration, sorted(
            (name, level.label) for name, level in vector.levels.items())))
        return int.from_bytes(hashlib.sha256(name.encode()).digest()[:7], "big")

    def run_id(self, vector: Vector, iteration: int) -> str:
        """The id of a run."""
        return vector.run_id(self.seed(vector, iteration))

    def scenario(self, vector: Vector, iteration: int) -> Loaded:
        """The scenario of a run."""
        loaded = self._variants.of(vector.changes)
        return replace(loaded, scenario=loaded.scenario.model_copy(
            update={"seed": self.seed(vector, iteration)}))


def _changes(loaded: LoadedDesign, levels: dict[str, Level]) -> tuple[Change, ...]:
    design = loaded.design
    settings = [Setting(key, value, ("set", key)) for key, value in design.set.items()]
    for family in ("stop", "measure"):
        settings += [Setting(f"{family}.{key}", value, (family, key))
                     for key, value in getattr(design, family).items()]
    settings += [setting for level in levels.values() for setting in level.settings]
    for setting in settings:
        if not all(setting.key.split(".")):
            raise loaded.wrong(setting.path, f"{setting.key!r} is not a key of the scenario, e.g. "
                                             "fleet.size")
        if setting.key in _OF_THE_DESIGN:
            raise loaded.wrong(setting.path, f"sets the scenario's {setting.key}, which is the "
                                             f"design's: {_OF_THE_DESIGN[setting.key]}")
    return (_KEEP_NOTHING, *(
        Change(setting.key, _filled(loaded, setting, setting.value, levels),
               loaded.places.value(setting.path)) for setting in settings))


def _filled(loaded: LoadedDesign, setting: Setting, value: object, levels: dict[str, Level],
            ) -> object:
    """``value`` with the values of parameters in place of each ``$name``."""
    if isinstance(value, dict):
        return {key: _filled(loaded, setting, below, levels) for key, below in value.items()}
    if isinstance(value, (list, tuple)):
        return [_filled(loaded, setting, below, levels) for below in value]
    if not (isinstance(value, str) and value.startswith("$")):
        return value
    name = value[1:]
    if name not in levels:
        raise loaded.wrong(setting.path, f"there is no parameter {name!r}"
                           f"{did_you_mean(name, levels)}; allowed: "
                           f"{', '.join('$' + known for known in levels) or 'none'}")
    return levels[name].value


def _refuse_iterations(loaded: LoadedDesign) -> None:
    rule = loaded.design.iterations
    if isinstance(rule, int):
        if rule < 1:
            raise loaded.wrong(("iterations",), f"must be at least 1, got {rule}")
        return
    if rule.at_least > rule.at_most:
        raise loaded.wrong(("iterations",), f"at_least {rule.at_least} is above at_most "
                                            f"{rule.at_most}")
    width = quantity(rule.width)
    if width is None or width.unit not in ("", "%") or width.number <= 0:
        raise loaded.wrong(("iterations", "width"), (
            f"{rule.width!r} is not a width; allowed: a number above zero, in the metric's unit, "
            "or a share of the mean such as '10 %'"))


def _refuse_unused(loaded: LoadedDesign) -> None:
    """Refuse a parameter without a key that nothing refers to. Raises ``InputError``."""
    design = loaded.design
    settings = [design.set, design.stop, design.measure,
                *(getattr(shape, "levels", {}) for shape in design.parameters.values())]
    used = {text[1:] for _, text in leaves(settings, ()) if text.startswith("$")}
    for name, shape in design.parameters.items():
        if getattr(shape, "key", "levels") is None and name not in used:
            raise loaded.wrong(("parameters", name), "sets nothing: give it a key, or use "
                                                     f"${name} in set or in levels")
