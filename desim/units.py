"""Quantities: ``"20 ms"`` to int nanoseconds, ``"54 Mb/s"`` to int bit/s, and back.

One dimension has one inner unit, named in the variables that hold it (``delay_ns``, ``rate_bps``).
``Annotated`` types at the bottom are what schema fields use; they accept text with a unit, refuse
a bare number, and print themselves with a unit again, so that a resolved scenario reads like one
written by hand.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from fractions import Fraction
from typing import Annotated, Any

from pydantic import BeforeValidator, PlainSerializer, WithJsonSchema

NS_PER_S = 1_000_000_000

_NUMBER = re.compile(r"\s*([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)\s*(\S.*?)?\s*$")


@dataclass(frozen=True)
class Dimension:
    """A kind of quantity: its inner unit and the units that it is written in.

    ``kind`` is ``int`` (rounded, exact arithmetic), ``float`` or ``Fraction``. ``units`` maps a
    written unit to its size in inner units; ``example`` is shown in error messages.
    """

    name: str
    inner: str
    kind: type
    units: dict[str, Fraction]
    example: str
    minimum: float | None = 0.0
    positive: bool = False

    def parse(self, value: Any) -> Any:
        """The quantity in inner units. Raises ``ValueError`` with what is wrong and allowed."""
        if isinstance(value, bool) or not isinstance(value, str):
            raise ValueError(f"{value!r} is not a {self.name}; write it with its unit, "
                             f"e.g. {self.example!r}")
        match = _NUMBER.match(value)
        if match is None:
            raise ValueError(f"{value!r} is not a {self.name}, e.g. {self.example!r}")
        number, unit = match.groups()
        if unit is None:
            raise ValueError(f"{value!r} has no unit; allowed: {', '.join(self.units)}, "
                             f"e.g. {self.example!r}")
        if unit not in self.units:
            raise ValueError(f"unknown unit {unit!r} for a {self.name}; allowed: "
                             f"{', '.join(self.units)}")
        exact = Fraction(number) * self.units[unit]
        if self.positive and exact <= 0:
            raise ValueError(f"{value!r} must be above zero")
        if self.minimum is not None and exact < Fraction(self.minimum):
            raise ValueError(f"{value!r} must not be negative")
        if self.kind is int:
            return round(exact)
        return exact if self.kind is Fraction else float(exact)

    def format(self, quantity: Any) -> str:
        """Text that parses back to ``quantity`` exactly, in the largest unit that stays short."""
        exact = Fraction(quantity)
        for unit, size in sorted(self.units.items(), key=lambda item: -item[1]):
            scaled = exact / size
            if scaled.denominator == 1 and (abs(scaled) >= 1 or exact == 0):
                return f"{scaled.numerator} {unit}" if exact else f"0 {self.inner}"
        if self.kind is Fraction:
            return _decimal(exact, self.inner)
        return f"{float(exact)!r} {self.inner}"


def _decimal(value: Fraction, unit: str) -> str:
    text = repr(float(value))
    if Fraction(text) != value:
        raise ValueError(f"{value} has no finite decimal form")
    return f"{text} {unit}"


def _scale(base: str, **prefixes: str) -> dict[str, Fraction]:
    return {prefix.rstrip("_") + base: Fraction(size) for prefix, size in prefixes.items()}


_SI = {"": 1, "k": 10**3, "M": 10**6, "G": 10**9}

DURATION = Dimension("duration", "ns", int, {
    "ns": Fraction(1), "us": Fraction(10**3), "µs": Fraction(10**3), "ms": Fraction(10**6),
    "s": Fraction(NS_PER_S), "min": Fraction(60 * NS_PER_S), "h": Fraction(3600 * NS_PER_S),
}, "20 ms")
BIT_RATE = Dimension("bit rate", "b/s", int, {
    **{p + "b/s": Fraction(f) for p, f in _SI.items()},
    **{p + "bit/s": Fraction(f) for p, f in _SI.items()},
    **{p + "B/s": Fraction(8 * f) for p, f in _SI.items()},
}, "54 Mb/s", positive=True)
BYTE_SIZE = Dimension("size", "B", int, {
    **{p + "B": Fraction(f) for p, f in _SI.items()},
    "KiB": Fraction(2**10), "MiB": Fraction(2**20),
}, "1500 B")
LENGTH = Dimension("length", "m", float, {
    "m": Fraction(1), "km": Fraction(1000), "cm": Fraction(1, 100), "mm": Fraction(1, 1000),
}, "200 m")
POSITION = Dimension("coordinate", "m", float, LENGTH.units, "-38 m", minimum=None)
ANGLE = Dimension("angle", "rad", float, {
    "rad": Fraction(1), "deg": Fraction(math.pi) / 180,
}, "0.5 rad", minimum=None)
SPEED = Dimension("speed", "m/s", float, {
    "m/s": Fraction(1), "cm/s": Fraction(1, 100), "km/h": Fraction(1000, 3600),
}, "1.2 m/s")
ANGULAR_SPEED = Dimension("angular speed", "rad/s", float, {
    "rad/s": Fraction(1), "deg/s": Fraction(math.pi) / 180,
}, "5.24 rad/s")
ACCELERATION = Dimension("acceleration", "m/s^2", float, {"m/s^2": Fraction(1)}, "2.5 m/s^2",
                         positive=True)
ANGULAR_ACCELERATION = Dimension("angular acceleration", "rad/s^2", float,
                                 {"rad/s^2": Fraction(1)}, "3.2 rad/s^2", positive=True)
FREQUENCY = Dimension("frequency", "Hz", Fraction, {
    "Hz": Fraction(1), "kHz": Fraction(1000), "mHz": Fraction(1, 1000),
}, "25 Hz", positive=True)
RATIO = Dimension("ratio", "%", float, {"%": Fraction(1, 100)}, "99 %")


def ns(seconds: float) -> int:
    """Seconds (float) to Python int nanoseconds. Raises ``ValueError`` for NaN, inf, negative."""
    if not 0.0 <= seconds < math.inf:
        raise ValueError(f"a duration must be finite and not negative, got {seconds!r} s")
    return round(float(seconds) * NS_PER_S)


def seconds(time_ns: int) -> float:
    """Nanoseconds to seconds, for physics formulas and reports only."""
    return time_ns / NS_PER_S


def airtime_ns(size_bytes: int, rate_bps: int) -> int:
    """Serialization time, rounded up: no frame ever beats its own rate.

    size_bytes * 8 / rate_bps seconds.
    """
    return -(-size_bytes * 8 * NS_PER_S // rate_bps)


def _field(dimension: Dimension) -> Any:
    def validate(value: Any) -> Any:
        if isinstance(value, (int, Fraction, float)) and not isinstance(value, (bool, str)):
            # Only code reaches this: YAML numbers are refused by the loader's strict context.
            raise ValueError(f"{value!r} has no unit; allowed: {', '.join(dimension.units)}, "
                             f"e.g. {dimension.example!r}")
        return dimension.parse(value)

    return Annotated[
        Any,
        BeforeValidator(validate),
        PlainSerializer(dimension.format, return_type=str),
        WithJsonSchema({"type": "string", "examples": [dimension.example],
                        "description": f"{dimension.name} with a unit: "
                                       f"{', '.join(dimension.units)}"}),
    ]


Duration = _field(DURATION)  # int ns
BitRate = _field(BIT_RATE)  # int bit/s
ByteSize = _field(BYTE_SIZE)  # int bytes
Length = _field(LENGTH)  # float m, not negative
Position = _field(POSITION)  # float m, any sign
Angle = _field(ANGLE)  # float rad
Speed = _field(SPEED)  # float m/s
AngularSpeed = _field(ANGULAR_SPEED)  # float rad/s
Acceleration = _field(ACCELERATION)  # float m/s^2
AngularAcceleration = _field(ANGULAR_ACCELERATION)  # float rad/s^2
Frequency = _field(FREQUENCY)  # Fraction Hz


def _ratio(value: Any) -> float:
    """``99 %`` or a plain number from 0 to 1."""
    if isinstance(value, (int, float)) and not isinstance(value, bool):
        ratio = float(value)
    else:
        ratio = RATIO.parse(value)
    if not 0.0 <= ratio <= 1.0:
        raise ValueError(f"{value!r} must lie between 0 and 1 (0 % and 100 %)")
    return ratio


Ratio = Annotated[
    Any, BeforeValidator(_ratio),
    WithJsonSchema({"anyOf": [{"type": "number", "minimum": 0, "maximum": 1},
                              {"type": "string", "examples": ["99 %"]}]}),
]
