"""Values of parameters as numbers: for ranges, for samples, for the axes of figures.

A value keeps the unit in which it is written; its meaning is a matter of the scenario.
"""

from __future__ import annotations

import re
from fractions import Fraction
from typing import NamedTuple

from desim import units
from desim.errors import InputError

_QUANTITY = re.compile(r"\s*([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d{1,2})?)\s*([^\d\s.].*?)?\s*")
# Dimension, and the unit in which its numbers are given, with the suffix of their names.
_GIVEN_IN = ((units.DURATION, "s", "_s"), (units.BIT_RATE, "b/s", "_bps"),
            (units.BYTE_SIZE, "B", "_bytes"), (units.POSITION, "m", "_m"),
            (units.ANGLE, "rad", "_rad"), (units.SPEED, "m/s", "_mps"),
            (units.ANGULAR_SPEED, "rad/s", "_radps"), (units.ACCELERATION, "m/s^2", "_mps2"),
            (units.ANGULAR_ACCELERATION, "rad/s^2", "_radps2"), (units.CARRIER, "Hz", "_hz"),
            (units.FREQUENCY, "Hz", "_hz"), (units.LEVEL, "dBm", "_dbm"),
            (units.DECIBELS, "dB", "_db"), (units.POWER, "W", "_w"), (units.ENERGY, "J", "_j"),
            (units.ENERGY_PER_WAY, "J/m", "_jpm"))
# Suffix of a column's name, to the unit of its numbers.
SUFFIXES = {"": "", **{suffix: unit for _, unit, suffix in _GIVEN_IN}}


class Quantity(NamedTuple):
    """A ``number`` of a ``unit``, which is "" for a bare number."""

    number: Fraction
    unit: str

    def of(self, number: Fraction | float) -> object:
        """``number`` of the same unit, as in a scenario: text, or a number without a unit."""
        exact = Fraction(number)
        if not self.unit:
            return int(exact) if exact.denominator == 1 else float(exact)
        plain = float(exact)
        return f"{int(plain) if plain.is_integer() else plain!r} {self.unit}"


def quantity(value: object) -> Quantity | None:
    """The number and unit of ``"10 Mb/s"``, ``"99 %"`` or 8; None for other values."""
    if isinstance(value, (int, float)) and not isinstance(value, bool):
        return Quantity(Fraction(value), "")
    match = _QUANTITY.fullmatch(value) if isinstance(value, str) else None
    return Quantity(Fraction(match[1]), match[2] or "") if match else None


def same_unit(first: object, *others: object) -> list[Quantity]:
    """All values as quantities of one unit. Raises ``InputError``."""
    found = []
    for value in (first, *others):
        one = quantity(value)
        if one is None:
            raise InputError(f"{value!r} is not a number, e.g. 8 or '10 Mb/s'")
        found.append(one)
    if len({one.unit for one in found}) > 1:
        raise InputError(f"{' and '.join(repr(value) for value in (first, *others))} have "
                         "different units; write them in one")
    return found


def as_numbers(values: list[object]) -> tuple[str, list[float]] | None:
    """The suffix of a name (``_bps``), and all values in its unit. None unless all values are
    numbers of one dimension."""
    found = [quantity(value) for value in values]
    scaled = [one for quantity_ in found if quantity_ and (one := _scaled(quantity_))]
    if not scaled or len(scaled) < len(values) or len({suffix for suffix, _ in scaled}) > 1:
        return None
    return scaled[0][0], [number for _, number in scaled]


def _scaled(one: Quantity) -> tuple[str, float] | None:
    if not one.unit:
        return "", float(one.number)
    if one.unit == "%":
        return "", float(one.number / 100)
    for dimension, unit, suffix in _GIVEN_IN:
        if one.unit in dimension.units:
            return suffix, float(one.number * dimension.units[one.unit] / dimension.units[unit])
    return None
