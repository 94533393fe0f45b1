"""The vectors of a design: the combinations of values that it runs."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Mapping

import numpy as np

from desim import plugins
from desim.campaign.design.design import (
    MOST_RUNS,
    Function,
    LatinHypercube,
    LoadedDesign,
    Saltelli,
    Sobol,
)
from desim.campaign.design.parameters import Level, Parameter
from desim.errors import InputError, described, did_you_mean

Combination = dict[str, Level]


def combinations(loaded: LoadedDesign, parameters: dict[str, Parameter]) -> list[Combination]:
    """The design's vectors: a level of each parameter. Raises ``InputError``."""
    vectors = loaded.design.vectors
    try:
        if isinstance(vectors, str):
            return _listed(loaded, vectors, parameters)
        if isinstance(vectors, (tuple, Function)):
            given: Iterable[object] = vectors if isinstance(vectors, tuple) else _answered(
                loaded, vectors.function)
            chosen = [_named(number, one, parameters) for number, one in enumerate(given)]
            _refuse_twins(chosen)
            return chosen
        return _sampled(loaded, _points(vectors, len(parameters), loaded.design.seed), parameters)
    except InputError as error:
        line = str(error)
        raise error if line.startswith(loaded.file) else loaded.wrong(("vectors",), line) from None


def _listed(loaded: LoadedDesign, which: str, parameters: dict[str, Parameter],
            ) -> list[Combination]:
    if which not in ("all", "zip"):
        raise InputError(f"{which!r} is not allowed{did_you_mean(which, ('all', 'zip'))}; allowed: "
                         "all, zip, a list of mappings, function, latin_hypercube, sobol, saltelli")
    levels = {name: parameter.levels for name, parameter in parameters.items()}
    for name, own in levels.items():
        if not own:
            raise loaded.wrong(("parameters", name), "has no values; give it values, a step or a "
                                                     "count, or let the vectors name them")
    count = math.prod(len(own) for own in levels.values())
    if which == "all":
        if count > MOST_RUNS:
            product = " x ".join(f"{len(own)} of {name}" for name, own in levels.items())
            raise InputError(f"all combinations are {count:,} ({product}); at most "
                             f"{MOST_RUNS:,}: leave out values, or take samples "
                             "(latin_hypercube)")
        return [dict(zip(levels, one, strict=True)) for one in itertools.product(*levels.values())]
    lengths = {name: len(own) for name, own in levels.items()}
    if len(set(lengths.values())) > 1:
        raise InputError("zip needs as many values of each parameter, but there are "
                         + ", ".join(f"{count} of {name}" for name, count in lengths.items()))
    return [dict(zip(levels, one, strict=True)) for one in zip(*levels.values(), strict=True)]


def _answered(loaded: LoadedDesign, name: str) -> Iterable[object]:
    """The vectors that a Python function returns."""
    if ":" not in name:
        raise InputError(f"function: {name!r} is not 'package.module:function'")
    function = plugins.imported("function", plugins.beside(name, loaded.folder(
        ("vectors", "function"))))
    if not callable(function):
        raise InputError(f"{name!r} is not a function")
    try:
        vectors = list(itertools.islice(iter(function()), MOST_RUNS + 1))
    except (Exception, SystemExit) as error:  # a user's function may fail in any way
        raise InputError(f"{name} raised {described(error)}") from error
    if len(vectors) > MOST_RUNS:
        raise InputError(f"{name} gives more than {MOST_RUNS:,}")
    return vectors


def _named(number: int, one: object, parameters: dict[str, Parameter]) -> Combination:
    if not isinstance(one, Mapping):
        raise InputError(f"vector {number} is {one!r}; it must be a mapping from parameter to "
                         "value")
    for name in one:
        if name not in parameters:
            raise InputError(f"vector {number} has an unknown parameter {name!r}"
                             f"{did_you_mean(str(name), parameters)}; allowed: "
                             f"{', '.join(parameters)}")
    missing = [name for name in parameters if name not in one]
    if missing:
        raise InputError(f"vector {number} has no {', '.join(missing)}")
    made = {}
    for name, parameter in parameters.items():
        try:
            made[name] = parameter.named(_plain(one[name]))
        except (InputError, TypeError) as error:  # TypeError: what JSON cannot hold
            raise InputError(f"vector {number}: {name}: {error}") from None
    return made


def _refuse_twins(vectors: list[Combination]) -> None:
    seen: dict[tuple[str, ...], int] = {}
    for number, one in enumerate(vectors):
        first = seen.setdefault(tuple(level.label for level in one.values()), number)
        if first != number:
            values = ", ".join(f"{name}: {level.label}" for name, level in one.items())
            raise InputError(f"vector {number} repeats vector {first} ({values})")


def _plain(value: object) -> object:
    """A number of numpy as one of Python, as scenarios have it; other values as they are."""
    return value.item() if isinstance(value, np.generic) else value


def _points(samples: LatinHypercube | Sobol | Saltelli, dimensions: int, seed: int) -> np.ndarray:
    """The samples [samples, dimensions] in [0, 1)."""
    from scipy.stats import qmc

    if not dimensions:
        raise InputError("there are no parameters to take samples of")
    if isinstance(samples, LatinHypercube):
        return qmc.LatinHypercube(dimensions, seed=seed).random(samples.latin_hypercube)
    if isinstance(samples, Sobol):
        doublings = (samples.sobol - 1).bit_length()
        return qmc.Sobol(dimensions, seed=seed).random_base2(doublings)[:samples.sobol]
    from desim.statistics.sensitivity import saltelli

    rows = samples.saltelli * (dimensions + 2)
    if rows > MOST_RUNS:
        raise InputError(f"saltelli: {samples.saltelli:,} points of {dimensions} parameters are "
                         f"{rows:,} vectors; at most {MOST_RUNS:,}")
    try:
        return saltelli(samples.saltelli, dimensions, seed)
    except ValueError as error:
        raise InputError(f"saltelli: {error}") from None


def _sampled(loaded: LoadedDesign, points: np.ndarray, parameters: dict[str, Parameter],
             ) -> list[Combination]:
    for name, parameter in parameters.items():
        if not parameter.levels and not hasattr(loaded.design.parameters[name], "to"):
            raise loaded.wrong(("parameters", name), "has no values to take samples of; give it "
                                                     "values, or from and to")
    return [{name: parameter.sampled(u) for (name, parameter), u in
             zip(parameters.items(), point.tolist(), strict=True)} for point in points]
