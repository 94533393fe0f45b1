"""The levels of a parameter: each has a label, and sets keys of the scenario."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Mapping
from fractions import Fraction
from typing import NamedTuple

from desim.campaign.design.design import Levels, LoadedDesign, Span, Values
from desim.campaign.design.quantities import Quantity, same_unit
from desim.errors import InputError, did_you_mean
from desim.scenario.source_places import Path

_MOST_LEVELS = 100_000  # of one parameter: a mistaken step is refused before it takes minutes
_DIGITS = 6  # of sampled and of logarithmic values


class Setting(NamedTuple):
    """One setting: ``key`` of the scenario gets ``value``, which stands at ``path`` of the design.
    """

    key: str
    value: object
    path: Path


class Level(NamedTuple):
    """One value of a parameter. ``value`` is what ``$name`` stands for."""

    label: str
    value: object
    settings: tuple[Setting, ...]


class Parameter(NamedTuple):
    """A parameter of a design. ``levels``: those that it lists. ``named`` makes a level of a value
    that a vector names, ``sampled`` one of a number from [0, 1)."""

    levels: list[Level]
    named: Callable[[object], Level]
    sampled: Callable[[float], Level]


def parameters_of(loaded: LoadedDesign) -> dict[str, Parameter]:
    """The design's parameters by name, in its order. Raises ``InputError``."""
    made = {}
    for name, shape in loaded.design.parameters.items():
        try:
            made[name] = _parameter(("parameters", name), shape)
            _refuse_rival(name, loaded.design.parameters)
        except InputError as error:
            raise loaded.wrong(("parameters", name), str(error)) from None
    return made


def _parameter(path: Path, shape: Values | Levels | Span) -> Parameter:
    if isinstance(shape, Values):
        return _of_values(path, shape)
    return _of_levels(path, shape) if isinstance(shape, Levels) else _of_span(path, shape)


def _refuse_rival(name: str, parameters: Mapping[str, Values | Levels | Span]) -> None:
    """Refuse a second parameter of one key: the later one would always win. Raises ``InputError``.
    """
    key = getattr(parameters[name], "key", None)
    first = name if key is None else next(other for other, shape in parameters.items()
                                          if getattr(shape, "key", None) == key)
    if first != name:
        raise InputError(f"sets {key}, which {first} sets, too; one of them is enough")


def _of_values(path: Path, shape: Values) -> Parameter:
    levels = [_level(value, shape.key, (*path, "values", i))
              for i, value in enumerate(shape.values)]
    _refuse_twins(levels)
    return Parameter(levels, lambda value: _level(value, shape.key, ("vectors",)),
                     _picking(levels))


def _of_levels(path: Path, shape: Levels) -> Parameter:
    if not shape.levels:
        raise InputError("has no levels")
    levels = [Level(label, label, tuple(
        Setting(key, value, (*path, "levels", label, key)) for key, value in settings.items()))
        for label, settings in shape.levels.items()]
    by_label = {level.label: level for level in levels}

    def named(value: object) -> Level:
        if not isinstance(value, str) or value not in by_label:
            raise InputError(f"{value!r} is not one of its levels"
                             f"{did_you_mean(str(value), by_label)}; allowed: "
                             f"{', '.join(by_label)}")
        return by_label[value]

    return Parameter(levels, named, _picking(levels))


def _of_span(path: Path, shape: Span) -> Parameter:
    first, last = same_unit(shape.from_, shape.to)
    if last.number < first.number:
        raise InputError(f"the range from {shape.from_!r} to {shape.to!r} is empty")
    whole = not first.unit and first.number.denominator == last.number.denominator == 1

    def sampled(u: float) -> Level:
        number: Fraction | float
        if shape.scale == "log":
            number = float(first.number) * (last.number / first.number) ** u
        elif whole:
            number = first.number + math.floor(u * (last.number - first.number + 1))
        else:
            number = float(first.number) + u * float(last.number - first.number)
        return _level(first.of(_rounded(number)), shape.key, path)

    if shape.scale == "log" and first.number <= 0:
        raise InputError("a logarithmic range begins above zero")
    levels = [_level(first.of(number), shape.key, path)
              for number in _numbers(shape, first, last, whole)]
    _refuse_twins(levels)
    return Parameter(levels, lambda value: _level(value, shape.key, ("vectors",)), sampled)


def _numbers(shape: Span, first: Quantity, last: Quantity, whole: bool) -> list[Fraction | float]:
    """The numbers of a range. Without a step and a count there are none: such a range is for
    samples."""
    if shape.count is not None:
        if shape.step is not None:
            raise InputError("has step and count; one of them is enough")
        if shape.scale == "log":
            ratio = float(last.number / first.number)
            return [_rounded(float(first.number) * ratio ** (i / (shape.count - 1)))
                    for i in range(shape.count)]
        return [first.number + (last.number - first.number) * i / (shape.count - 1)
                for i in range(shape.count)]
    if shape.scale == "log":
        if shape.step is not None:
            raise InputError("a logarithmic range has a count, not a step")
        return []
    if shape.step is None and not whole:
        return []
    step = same_unit(first.of(first.number), 1 if shape.step is None else shape.step)[1].number
    if step <= 0:
        raise InputError(f"the step {shape.step!r} must be above zero")
    count = (last.number - first.number) // step + 1
    if count > _MOST_LEVELS:
        raise InputError(f"has more than {_MOST_LEVELS:,} values")
    return [first.number + i * step for i in range(count)]


def label_of(value: object) -> str:
    """A value in words: text as it is, anything else as JSON."""
    return value if isinstance(value, str) else json.dumps(value)


def _level(value: object, key: str | None, path: Path) -> Level:
    return Level(label_of(value), value, () if key is None else (Setting(key, value, path),))


def _picking(levels: list[Level]) -> Callable[[float], Level]:
    """A function that picks a level by a number: each has the same share of [0, 1)."""
    return lambda u: levels[math.floor(u * len(levels))]


def _refuse_twins(levels: list[Level]) -> None:
    seen: set[str] = set()
    for level in levels:
        if level.label in seen:
            raise InputError(f"the value {level.label} stands there twice")
        seen.add(level.label)


def _rounded(number: Fraction | float) -> Fraction | float:
    return number if isinstance(number, Fraction) else float(f"{number:.{_DIGITS}g}")
