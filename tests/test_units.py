"""Quantities: exact both ways, and refused with a reason."""

from fractions import Fraction

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import BaseModel, TypeAdapter

from desim import units
from desim.ports import Params
from desim.units import (
    ANGLE,
    BIT_RATE,
    BYTE_SIZE,
    CARRIER,
    DECIBELS,
    DURATION,
    ENERGY,
    FREQUENCY,
    LENGTH,
    LEVEL,
    PERIOD,
    POSITION,
    RATIO,
    SPEED,
    airtime_ns,
    ns,
)

ALL = [value for value in vars(units).values() if isinstance(value, units.Dimension)]


@pytest.mark.parametrize("dimension, text, inner", [
    (DURATION, "20 ms", 20_000_000),
    (DURATION, "0.5s", 500_000_000),
    (DURATION, " 1e-3 ms ", 1000),
    (DURATION, "10 us", 10_000),
    (DURATION, "10 µs", 10_000),
    (DURATION, "2 min", 120_000_000_000),
    (DURATION, "0 s", 0),
    (BIT_RATE, "54 Mb/s", 54_000_000),
    (BIT_RATE, "1.5 kB/s", 12_000),
    (BYTE_SIZE, "64 KiB", 65_536),
    (LENGTH, "20 cm", 0.2),
    (POSITION, "-38 m", -38.0),
    (LEVEL, "-82 dBm", -82.0),
    (DECIBELS, "46.6777 dB", 46.6777),
    (CARRIER, "5.18 GHz", 5.18e9),
    (SPEED, "36 km/h", 10.0),
    (FREQUENCY, "25 Hz", Fraction(25)),
    (FREQUENCY, "0.1 Hz", Fraction(1, 10)),
    (RATIO, "99 %", 0.99),
])
def test_reads(dimension, text, inner):
    assert dimension.parse(text) == inner
    assert type(dimension.parse(text)) is dimension.kind


@pytest.mark.parametrize("dimension, value, complaint", [
    (DURATION, 5, "5 has no unit; allowed: s, ms, us, ns, min, h, µs, e.g. '20 ms'"),
    (DURATION, 0, "0 has no unit; allowed: s, ms, us, ns, min, h, µs, e.g. '20 ms'"),
    (LENGTH, "200", "'200' has no unit; allowed: m, km, cm, mm, e.g. '200 m'"),
    (LENGTH, "200 s", "unknown unit 's' for a length; allowed: m, km, cm, mm, e.g. '200 m'"),
    (ENERGY, "7 Ah", "unknown unit 'Ah' for an energy; allowed: J, kJ, Wh, kWh, e.g. '260 Wh'"),
    (LENGTH, True, "True is not a length; allowed: m, km, cm, mm, e.g. '200 m'"),
    (LENGTH, "nan m", "'nan m' is not a length; allowed: m, km, cm, mm, e.g. '200 m'"),
    (LENGTH, "inf m", "'inf m' is not a length; allowed: m, km, cm, mm, e.g. '200 m'"),
    (LENGTH, "-1 m", "'-1 m' must not be negative"),
    (LENGTH, "1e12 m", "'1e12 m' is too large; at most 1000000000 m"),
    (LENGTH, "1e999999999 m", "unknown unit 'e999999999 m' for a length; allowed: m, km, cm, mm, "
                              "e.g. '200 m'"),
    (LENGTH, "0." + "1" * 50 + " m", "'0." + "1" * 50 + " m' has too many digits; at most 40"),
    (DURATION, "0.2 ns", "'0.2 ns' is too small; at least 1 ns"),
    (DURATION, "1e11 s", "'1e11 s' is too large; at most 1000000000 s"),
    (DURATION, "1e100 s", "'1e100 s' is too large; at most 1000000000 s"),
    (PERIOD, "0 s", "'0 s' must be above zero"),
    (BIT_RATE, "-5 Mb/s", "'-5 Mb/s' must be above zero"),
    (FREQUENCY, "20 kHz", "'20 kHz' is too large; at most 10 kHz"),
    (RATIO, "120 %", "'120 %' is too large; at most 100 %"),
])
def test_refuses(dimension, value, complaint):
    with pytest.raises(ValueError) as caught:
        dimension.parse(value)
    assert str(caught.value) == complaint


@pytest.mark.parametrize("dimension, text", [
    (DURATION, "1.5 ms"), (DURATION, "60 s"), (DURATION, "1 h"), (BIT_RATE, "1 Gb/s"),
    (LENGTH, "0.022 m"), (ANGLE, "190 deg"), (FREQUENCY, "25 Hz"), (SPEED, "1.2 m/s"),
    (BYTE_SIZE, "1500 B"),
])
def test_writes_as_a_person_would(dimension, text):
    assert dimension.format(dimension.parse(text)) == text


@given(st.sampled_from(ALL), st.decimals(allow_nan=False, allow_infinity=False, places=9,
                                         min_value=-10**6, max_value=10**6), st.data())
def test_what_is_read_can_be_written_and_read_again(dimension, number, data):
    text = f"{number} {data.draw(st.sampled_from(list(dimension.units)))}"
    try:
        quantity = dimension.parse(text)
    except ValueError:
        return  # out of this dimension's range
    assert dimension.parse(dimension.format(quantity)) == quantity


@given(st.integers(0, 10**18))
def test_every_nanosecond_has_a_text(time_ns):
    assert DURATION.parse(DURATION.format(time_ns)) == time_ns


@given(st.floats(1e-30, 1e9))
def test_every_length_has_a_text(length_m):
    assert LENGTH.parse(LENGTH.format(length_m)) == length_m


@given(st.floats(0, 1))
def test_every_ratio_has_a_text(ratio):
    adapter = TypeAdapter(units.Ratio)
    assert adapter.validate_python(adapter.dump_python(ratio, mode="json")) == ratio


@given(st.text(max_size=80))
def test_any_text_is_a_quantity_or_a_value_error(text):
    for dimension in ALL:
        try:
            dimension.parse(text)
        except ValueError as error:
            assert str(error)


@given(st.integers(1, 10**6), st.integers(1, 10**11))
def test_no_frame_beats_its_rate(size_bytes, rate_bps):
    time_ns = airtime_ns(size_bytes, rate_bps)
    assert time_ns * rate_bps >= size_bytes * 8 * units.NS_PER_S > (time_ns - 1) * rate_bps


@pytest.mark.parametrize("seconds", [float("nan"), float("inf"), -1e-9])
def test_ns_refuses_what_is_no_duration(seconds):
    with pytest.raises(ValueError, match="must be finite and not negative"):
        ns(seconds)


def test_a_field_has_its_unit_in_the_name_and_its_key_has_not():
    class Radio(Params):
        rate_bps: units.BitRate = "54 Mb/s"
        share: units.Ratio = 0.5

    assert Radio(rate="1 Gb/s").rate_bps == 10**9
    assert Radio().model_dump(mode="json", by_alias=True) == {"rate": "54 Mb/s", "share": "50 %"}


def test_the_json_schema_pattern_accepts_what_parse_accepts():
    import re

    class Anything(BaseModel):
        angle: units.Angle
        delay: units.Duration

    properties = Anything.model_json_schema()["properties"]
    assert re.search(properties["angle"]["pattern"], "-0.5 rad")
    assert re.search(properties["delay"]["pattern"], "1e3 ms")
    assert not re.search(properties["delay"]["pattern"], "-1 s")
    assert not re.search(properties["delay"]["pattern"], "5")
