"""Values of parameters as numbers: for ranges, for samples, for the axes of figures.

What a value means is the scenario's matter; here only the unit that it is written in counts.
"""

from __future__ import annotations

import re
from fractions import Fraction
from typing import Any, NamedTuple

from desim import units
from desim.errors import InputError

_QUANTITY = re.compile(r"\s*([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d{1,2})?)\s*([^\d\s.].*?)?\s*")
# Dimension, and the unit that numbers of it are told in, with the suffix of their names.
_TOLD_IN = ((units.DURATION, "s", "_s"), (units.BIT_RATE, "b/s", "_bps"),
            (units.BYTE_SIZE, "B", "_bytes"), (units.POSITION, "m", "_m"),
            (units.ANGLE, "rad", "_rad"), (units.SPEED, "m/s", "_mps"),
            (units.ANGULAR_SPEED, "rad/s", "_radps"), (units.ACCELERATION, "m/s^2", "_mps2"),
            (units.ANGULAR_ACCELERATION, "rad/s^2", "_radps2"), (units.CARRIER, "Hz", "_hz"),
            (units.FREQUENCY, "Hz", "_hz"), (units.LEVEL, "dBm", "_dbm"),
            (units.DECIBELS, "dB", "_db"))
_PERCENT = "%"
# Of the names of columns, to the unit that their numbers are told in.
SUFFIXES = {"": "", **{suffix: unit for _, unit, suffix in _TOLD_IN}}


class Quantity(NamedTuple):
    """``number`` of a ``unit``; "" for a bare number."""

    number: Fraction
    unit: str

    def of(self, number: Fraction | float) -> Any:
        """``number`` of the same unit, as a scenario has it: text, or a number without a unit."""
        exact = Fraction(number)
        if not self.unit:
            return int(exact) if exact.denominator == 1 else float(exact)
        plain = float(exact)
        return f"{int(plain) if plain.is_integer() else plain!r} {self.unit}"


def quantity(value: Any) -> Quantity | None:
    """``"10 Mb/s"``, ``"99 %"`` or 8 taken apart; None for what is not a number."""
    if isinstance(value, (int, float)) and not isinstance(value, bool):
        return Quantity(Fraction(value), "")
    match = _QUANTITY.fullmatch(value) if isinstance(value, str) else None
    return Quantity(Fraction(match[1]), match[2] or "") if match else None


def same_unit(first: Any, *others: Any) -> list[Quantity]:
    """All of them as quantities of one unit. Raises ``InputError``."""
    found = [quantity(value) for value in (first, *others)]
    for value, one in zip((first, *others), found, strict=True):
        if one is None:
            raise InputError(f"{value!r} is not a number, e.g. 8 or '10 Mb/s'")
    if len({one.unit for one in found}) > 1:
        raise InputError(f"{' and '.join(repr(value) for value in (first, *others))} have "
                         "different units; write them in one")
    return found


def as_numbers(values: list[Any]) -> tuple[str, list[float]] | None:
    """The suffix of a name (``_bps``) and all values in its unit; None unless all of them are
    numbers of one dimension."""
    found = [quantity(value) for value in values]
    if None in found or not found:
        return None
    scaled = [_scaled(one) for one in found]
    if None in scaled or len({suffix for suffix, _ in scaled}) > 1:
        return None
    return scaled[0][0], [number for _, number in scaled]


def _scaled(one: Quantity) -> tuple[str, float] | None:
    if not one.unit:
        return "", float(one.number)
    if one.unit == _PERCENT:
        return "", float(one.number / 100)
    for dimension, unit, suffix in _TOLD_IN:
        if one.unit in dimension.units:
            return suffix, float(one.number * dimension.units[one.unit] / dimension.units[unit])
    return None
