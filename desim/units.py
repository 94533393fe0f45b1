"""Quantities: ``"20 ms"`` to int nanoseconds, ``"54 Mb/s"`` to int bit/s, and back.

One dimension has one inner unit, named in the variables that hold it (``delay_ns``, ``rate_bps``).
``Annotated`` types at the bottom are what schema fields use; they accept text with a unit, refuse
a bare number (zero too: one rule), and print themselves with a unit again, so that a resolved
scenario reads like one written by hand.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import cached_property, lru_cache
from typing import Annotated, Any

from pydantic import BeforeValidator, PlainSerializer, WithJsonSchema

NS_PER_S = 1_000_000_000
NEVER_NS = 1 << 62  # after all that happens
MM_PER_M = 1000
MRAD_PER_RAD = 1000

Number = int | float | Fraction  # a quantity in inner units: of its dimension's ``kind``

# Three digits of exponent are more than any quantity needs, and keep the exact arithmetic short.
_DECIMAL = r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d{1,3})?"
_NUMBER = re.compile(rf"\s*({_DECIMAL})(?![\d.])\s*(\S.*?)?\s*")
_REMEMBERED = 1024  # quantities of a dimension
_LONGEST_NUMBER, _LONGEST = 40, 60  # characters; more would only cost time in exact arithmetic


@dataclass(frozen=True)
class Dimension:
    """A kind of quantity: its inner unit and the units that it is written in.

    ``kind`` is ``int`` (rounded, exact arithmetic), ``float`` or ``Fraction``. ``units`` maps a
    unit to its size in inner units; those in ``aliases`` are read but not written. ``maximum`` and
    ``least``, the smallest quantity beside zero, are in inner units and inclusive; ``example`` is
    shown in error messages. There are no parts of what is ``whole``.
    """

    name: str
    inner: str
    kind: type
    units: dict[str, Fraction]
    example: str
    signed: bool = False
    positive: bool = False
    whole: bool = False
    maximum: int = 10**15
    least: Fraction = Fraction(1, 10**30)
    aliases: tuple[str, ...] = ()

    def parse(self, value: object) -> Any:
        """The quantity in inner units. Raises ``ValueError`` with what is wrong and allowed."""
        if isinstance(value, (int, float, Fraction)) and not isinstance(value, bool):
            raise ValueError(f"{value} has no unit; {self._allowed}")
        if not isinstance(value, str):
            raise ValueError(f"{_short(value)} is not {self._a_name}; {self._allowed}")
        return self._read(value)

    def format(self, quantity: Number) -> str:
        """The shortest text that parses back to ``quantity`` exactly."""
        return self._shortest(quantity)

    # A campaign reads and writes the same quantities in each of its thousands of scenarios, and the
    # exact arithmetic takes its time.

    @cached_property
    def _read(self) -> Callable[[str], Number]:
        return lru_cache(_REMEMBERED)(self._parsed)

    @cached_property
    def _shortest(self) -> Callable[[Number], str]:
        return lru_cache(_REMEMBERED, typed=True)(self._formatted)

    def _parsed(self, value: str) -> Number:
        match = _NUMBER.fullmatch(value)
        if match is None or len(value) > _LONGEST:
            raise ValueError(f"{_short(value)} is not {self._a_name}; {self._allowed}")
        number, unit = match.groups()
        if len(number) > _LONGEST_NUMBER:
            raise ValueError(f"{_short(value)} has too many digits; at most {_LONGEST_NUMBER}")
        if unit is None:
            raise ValueError(f"{value!r} has no unit; {self._allowed}")
        if unit not in self.units:
            raise ValueError(f"unknown unit {unit!r} for {self._a_name}; {self._allowed}")
        return self._inner(value, Fraction(number) * self.units[unit])

    def _inner(self, text: str, exact: Fraction) -> Number:
        if self.positive and exact <= 0:
            raise ValueError(f"{text!r} must be above zero")
        if exact < 0 and not self.signed:
            raise ValueError(f"{text!r} must not be negative")
        if abs(exact) > self.maximum:
            raise ValueError(f"{text!r} is too large; at most {self.format(self.maximum)}")
        if 0 < abs(exact) < self.least:
            raise ValueError(f"{text!r} is too small; at least {self.format(self.least)}")
        if self.whole and exact.denominator != 1:
            raise ValueError(f"{text!r} is not a whole number of {self.inner}")
        if self.kind is int:
            return round(exact)
        return exact if self.kind is Fraction else float(exact)

    def _formatted(self, quantity: Number) -> str:
        exact = Fraction(quantity)
        texts = [f"{_plain(float(exact / size))} {unit}" for unit, size in self.units.items()
                 if unit not in self.aliases]
        # Sorting keeps the order of ``units`` among texts that are equally good.
        for text in sorted(texts, key=lambda text: ("e+" in text or "e-" in text, len(text))):
            number, _, unit = text.partition(" ")
            read = Fraction(number) * self.units[unit]
            if read == exact or (self.kind is float and float(read) == quantity):
                return text
        return f"{_digits(exact) if self.kind is Fraction else repr(quantity)} {self.inner}"

    @property
    def _a_name(self) -> str:
        return f"{'an' if self.name[0] in 'aeiou' else 'a'} {self.name}"

    @cached_property
    def _allowed(self) -> str:
        return f"allowed: {', '.join(self.units)}, e.g. {self.example!r}"

    @cached_property
    def json_schema(self) -> dict[str, object]:
        """The JSON schema of this quantity, for editors."""
        number = _DECIMAL if self.signed else _DECIMAL.removeprefix("[+-]?")
        units = "|".join(re.escape(unit) for unit in self.units)
        return {"type": "string", "pattern": rf"^\s*{number}\s*({units})\s*$",
                "examples": [self.example]}


def _plain(value: float) -> str:
    """At most 12 digits, without an exponent where that stays readable."""
    return f"{value:.0f}" if value.is_integer() and abs(value) < 1e15 else f"{value:.12g}"


def _digits(value: Fraction) -> str:
    """All digits of a fraction whose denominator divides a power of ten."""
    for places in range(2 * _LONGEST):
        scaled = value * 10**places
        if scaled.denominator == 1:
            return f"{scaled.numerator}e-{places}" if places else str(scaled.numerator)
    raise ValueError(f"{value} has no finite decimal form")


def _short(value: object) -> str:
    text = repr(value)
    return text if len(text) <= _LONGEST else text[:_LONGEST - 3] + "..."


_SI = {"": 1, "k": 10**3, "M": 10**6, "G": 10**9}
_PER_DEGREE = Fraction(math.pi) / 180

DURATION = Dimension("duration", "ns", int, {
    "s": Fraction(NS_PER_S), "ms": Fraction(10**6), "us": Fraction(10**3), "ns": Fraction(1),
    "min": Fraction(60 * NS_PER_S), "h": Fraction(3600 * NS_PER_S), "µs": Fraction(10**3),
}, "20 ms", maximum=10**18, least=Fraction(1),
   aliases=("µs",))
PERIOD = Dimension("period", "ns", int, DURATION.units, "5 s", positive=True, maximum=10**18,
                   least=Fraction(1), aliases=DURATION.aliases)
# Of what happens again and again: more often than this nothing would ever get done.
PACE = replace(PERIOD, least=Fraction(10**6))
# Of processors, for parts of a callback: a byte costs less than a nanosecond.
COST = Dimension("processor time", "ps", int, {
    "ms": Fraction(10**9), "us": Fraction(10**6), "ns": Fraction(1000), "ps": Fraction(1),
    "s": Fraction(10**12), "µs": Fraction(10**6),
}, "0.4 ns", maximum=10**18, least=Fraction(1), aliases=("µs", "s"))
BIT_RATE = Dimension("bit rate", "b/s", int, {
    **{p + "b/s": Fraction(f) for p, f in _SI.items()},
    **{p + "bit/s": Fraction(f) for p, f in _SI.items()},
    **{p + "B/s": Fraction(8 * f) for p, f in _SI.items()},
}, "54 Mb/s", positive=True, least=Fraction(1),
   aliases=tuple(p + u for u in ("bit/s", "B/s") for p in _SI))
BYTE_SIZE = Dimension("size", "B", int, {
    **{p + "B": Fraction(f) for p, f in _SI.items()},
    "KiB": Fraction(2**10), "MiB": Fraction(2**20),
}, "1500 B", whole=True)
# Of a message: roscpp takes a longer one for a loss of synchronization (1 GB, transport_publisher_
# link.cpp).
MESSAGE_SIZE = replace(BYTE_SIZE, maximum=10**9, example="640 kB")
LENGTH = Dimension("length", "m", float, {
    "m": Fraction(1), "km": Fraction(1000), "cm": Fraction(1, 100), "mm": Fraction(1, 1000),
}, "200 m", maximum=10**9, aliases=("cm", "mm", "km"))
POSITION = Dimension("coordinate", "m", float, LENGTH.units, "-38 m", signed=True, maximum=10**9,
                     aliases=LENGTH.aliases)
ANGLE = Dimension("angle", "rad", float, {
    "rad": Fraction(1), "deg": _PER_DEGREE,
}, "0.5 rad", signed=True, maximum=10**6)
SPEED = Dimension("speed", "m/s", float, {
    "m/s": Fraction(1), "cm/s": Fraction(1, 100), "km/h": Fraction(1000, 3600),
}, "1.2 m/s", maximum=10**6, aliases=("cm/s",))
ANGULAR_SPEED = Dimension("angular speed", "rad/s", float, {
    "rad/s": Fraction(1), "deg/s": _PER_DEGREE,
}, "5.24 rad/s", maximum=10**6)
ACCELERATION = Dimension("acceleration", "m/s^2", float, {"m/s^2": Fraction(1)}, "2.5 m/s^2",
                         positive=True, maximum=10**6)
ANGULAR_ACCELERATION = Dimension("angular acceleration", "rad/s^2", float,
                                 {"rad/s^2": Fraction(1)}, "3.2 rad/s^2", positive=True,
                                 maximum=10**6)
# Far above what sensors and controllers do; a run at such a rate still comes to its end.
FREQUENCY = Dimension("frequency", "Hz", Fraction, {
    "Hz": Fraction(1), "kHz": Fraction(1000), "mHz": Fraction(1, 1000),
}, "25 Hz", positive=True, maximum=10_000, least=Fraction(1, NS_PER_S))
# Of carriers; ``FREQUENCY`` is of what happens again and again.
CARRIER = Dimension("carrier frequency", "Hz", float, {
    "Hz": Fraction(1), "kHz": Fraction(10**3), "MHz": Fraction(10**6), "GHz": Fraction(10**9),
}, "2412 MHz", positive=True, maximum=10**12)
LEVEL = Dimension("power level", "dBm", float, {"dBm": Fraction(1)}, "16 dBm", signed=True,
                  maximum=1000)
DECIBELS = Dimension("ratio of powers", "dB", float, {"dB": Fraction(1)}, "7 dB", maximum=1000)
POWER = Dimension("power", "W", float, {
    "W": Fraction(1), "mW": Fraction(1, 1000), "kW": Fraction(1000),
}, "22 W", maximum=10**6, aliases=("mW", "kW"))
ENERGY = Dimension("energy", "J", float, {
    "J": Fraction(1), "kJ": Fraction(1000), "Wh": Fraction(3600), "kWh": Fraction(3_600_000),
}, "260 Wh", positive=True, maximum=10**12, aliases=("kJ", "Wh", "kWh"))
# What a way costs: a watt for each metre a second.
ENERGY_PER_WAY = Dimension("energy per way", "J/m", float, {
    "J/m": Fraction(1), "kJ/km": Fraction(1),
}, "6.5 J/m", maximum=10**6, aliases=("kJ/km",))
# Of clocks; 1000 ppm is a clock that nobody would keep.
DRIFT = Dimension("drift", "ppb", int, {"ppm": Fraction(1000), "ppb": Fraction(1)}, "20 ppm",
                  signed=True, maximum=10**6, least=Fraction(1))
RATIO = Dimension("ratio", "%", float, {"%": Fraction(1, 100)}, "99 %", maximum=1)


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


def rate_text(rate_bps: float, digits: int = 2) -> str:
    """A bit rate in Mb/s, or in kb/s where it is below a tenth of one."""
    if rate_bps < _SI["M"] / 10:
        return f"{rate_bps / _SI['k']:.{digits}f} kb/s"
    return f"{rate_bps / _SI['M']:.{digits}f} Mb/s"


def size_text(size_bytes: float) -> str:
    """A size in MB, or in kB where it is below a tenth of one."""
    if size_bytes < _SI["M"] / 10:
        return f"{size_bytes / _SI['k']:.1f} kB"
    return f"{size_bytes / _SI['M']:.1f} MB"


def _field(dimension: Dimension) -> Any:
    return Annotated[
        Any,
        BeforeValidator(dimension.parse),
        PlainSerializer(dimension.format, return_type=str),
        WithJsonSchema(dimension.json_schema),
    ]


Duration = _field(DURATION)  # int ns
Period = _field(PERIOD)  # int ns, above zero
Pace = _field(PACE)  # int ns, at least 1 ms
Cost = _field(COST)  # int ps
BitRate = _field(BIT_RATE)  # int bit/s
ByteSize = _field(BYTE_SIZE)  # int bytes
MessageSize = _field(MESSAGE_SIZE)  # int bytes, at most 1 GB
Length = _field(LENGTH)  # float m, not negative
Position = _field(POSITION)  # float m, any sign
Angle = _field(ANGLE)  # float rad
Speed = _field(SPEED)  # float m/s
AngularSpeed = _field(ANGULAR_SPEED)  # float rad/s
Acceleration = _field(ACCELERATION)  # float m/s^2
AngularAcceleration = _field(ANGULAR_ACCELERATION)  # float rad/s^2
Frequency = _field(FREQUENCY)  # Fraction Hz
Carrier = _field(CARRIER)  # float Hz
Level = _field(LEVEL)  # float dBm, any sign
Decibels = _field(DECIBELS)  # float dB, not negative
Power = _field(POWER)  # float W
Energy = _field(ENERGY)  # float J, above zero
EnergyPerWay = _field(ENERGY_PER_WAY)  # float J/m
Drift = _field(DRIFT)  # int ppb, any sign


def _ratio(value: object) -> float:
    """``99 %`` or a plain number from 0 to 1."""
    if isinstance(value, (int, float)) and not isinstance(value, bool):
        if not 0.0 <= value <= 1.0:
            raise ValueError(f"{value!r} must lie between 0 and 1 (0 % and 100 %)")
        return float(value)
    return float(RATIO.parse(value))


def _ratio_text(ratio: float) -> str | float:
    """With ``%`` where that is exact."""
    percent = _plain(ratio * 100)
    return f"{percent} %" if float(Fraction(percent) / 100) == ratio >= 1e-9 else ratio


Ratio = Annotated[
    Any, BeforeValidator(_ratio), PlainSerializer(_ratio_text),
    WithJsonSchema({"anyOf": [{"type": "number", "minimum": 0, "maximum": 1},
                              RATIO.json_schema]}),
]
