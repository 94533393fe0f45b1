"""Parameter blocks as options: what is read, and every complaint to the letter."""

from typing import Literal

import pytest
from pydantic import Field

from desim.commands.options import as_options, descriptions, parsed
from desim.errors import InputError
from desim.ports import Params
from desim.units import BitRate, ByteSize, Frequency, Length, Period


class Block(Params):
    standard: Literal["11a", "11b"] = Field("11a", description="timing (ours)")
    rate_bps: BitRate | None = Field(None, examples=["54 Mb/s"], description="of data (highest)")
    distance_m: Length = Field("40 m", description="between them (near)")
    payload_bytes: ByteSize = Field("1000 B", le=2000, description="of UDP (ours)")
    hz: Frequency = Field("10 Hz", description="(ours)")
    slot_ns: Period = Field("9 us", description="of the backoff (ours)")
    queue_packets: int | None = Field(100, ge=1, description="that wait (ours)")
    load: float = Field(0.9, gt=0, description="of the capacity (ours)")
    rts: bool = Field(False, description="ask first (no)")


class Fleet(Params):
    scenario: str = Field(description="a file")
    stations: int = Field(3, description="(three)")
    overrides: tuple[str, ...] = Field((), alias="set", examples=["A=B"], description="again")


ALLOWED = ("allowed: --standard, --rate, --distance, --payload, --hz, --slot, --queue-packets, "
           "--load, --rts, --json")


def read(line, block=Block):
    return parsed(line.split(), block, ("json",))


def test_a_bare_number_has_the_unit_of_the_default():
    block = read("--rate 5.5 --distance 50 --payload 1500 --hz 2.5 --slot 20 --queue-packets 7 "
                 "--load 1.05 --standard 11b")
    assert (block.rate_bps, block.distance_m, block.payload_bytes, block.hz, block.slot_ns,
            block.queue_packets, block.load, block.standard) == (
        5_500_000, 50.0, 1500, 2.5, 20_000, 7, 1.05, "11b")


def test_a_unit_can_be_said():
    block = parsed(["--rate", "500 kb/s", "--distance=1km", "--slot=9000ns", "--load", "2"], Block)
    assert (block.rate_bps, block.distance_m, block.slot_ns, block.load) == (
        500_000, 1000.0, 9000, 2.0)


@pytest.mark.parametrize(("line", "rts"), [("", False), ("--rts", True), ("--rts --load 1", True),
                                           ("--rts no", False), ("--rts=on", True),
                                           ("--rts true", True)])
def test_flags(line, rts):
    assert read(line).rts is rts


def test_none():
    assert read("--queue_packets none").queue_packets is None


def test_a_word_alone_is_the_option_without_a_default():
    assert read("a.yaml --stations 5", Fleet) == Fleet(scenario="a.yaml", stations=5)
    assert read("--stations 5 a.yaml", Fleet) == read("--scenario a.yaml --stations=5", Fleet)


def test_some_options_can_be_given_again():
    assert read("a.yaml --set x=1 --stations 5 --set=none", Fleet).overrides == ("x=1", "none")
    assert read("a.yaml", Fleet).overrides == ()
    assert list(descriptions(Fleet))[2] == ("--set A=B", "again")
    with pytest.raises(InputError, match="--set: its value is missing, e.g. --set A=B"):
        read("a.yaml --set", Fleet)


@pytest.mark.parametrize(("line", "says"), [
    ("--rat 5", f"--rat: there is no such option (did you mean 'rate'?); {ALLOWED}"),
    ("--jsn", f"--jsn: there is no such option (did you mean 'json'?); {ALLOWED}"),
    ("--zzz=4", f"--zzz: there is no such option; {ALLOWED}"),
    ("-x 5", "'-x' is no option; wanted: --key value"),
    ("11a", "'11a' is no option; wanted: --key value"),
    ("--rate", "--rate: its value is missing, e.g. --rate 54 Mb/s"),
    ("--rate --load 3", "--rate: its value is missing, e.g. --rate 54 Mb/s"),
    ("--load 1 --load 2", "--load: it is given twice"),
    ("--rate 5m", "--rate: unknown unit 'm' for a bit rate; allowed: b/s, kb/s, Mb/s, Gb/s, bit/s, "
                  "kbit/s, Mbit/s, Gbit/s, B/s, kB/s, MB/s, GB/s, e.g. '54 Mb/s', or none"),
    ("--rate fast", "--rate: 'fast' is not a bit rate; allowed: b/s, kb/s, Mb/s, Gb/s, bit/s, "
                    "kbit/s, Mbit/s, Gbit/s, B/s, kB/s, MB/s, GB/s, e.g. '54 Mb/s', or none"),
    ("--rate 0", "--rate: '0 Mb/s' must be above zero"),
    ("--distance -3", "--distance: '-3 m' must not be negative"),
    ("--payload 3000", "--payload: must be at most 2 kB, got '3000 B'"),
    ("--queue-packets 0", "--queue-packets: must be at least 1, got 0"),
    ("--queue-packets 2.5", "--queue-packets: must be a whole number, got 2.5"),
    ("--queue-packets many", "--queue-packets: must be a whole number, got 'many'"),
    ("--load none", "--load: must be a number, got 'none'"),
    ("--rts=maybe", "--rts: must be true or false, got 'maybe'"),
    ("--standard 11c", "--standard: '11c' is not allowed (did you mean '11b'?); allowed: 11a, 11b"),
])
def test_complaints(line, says):
    with pytest.raises(InputError) as caught:
        read(line)
    assert str(caught.value) == says


def test_all_that_is_wrong_is_said_at_once():
    with pytest.raises(InputError) as caught:
        read("--load -1 --queue-packets 0")
    assert caught.value.args == ("--queue-packets: must be at least 1, got 0",
                                 "--load: must be above 0, got -1")


def test_an_option_without_a_default_has_to_be_given():
    with pytest.raises(InputError) as caught:
        read("", Fleet)
    assert str(caught.value) == "SCENARIO is missing: a file"


def test_what_a_plug_in_says_of_its_parameters():
    with pytest.raises(InputError) as caught, as_options():
        raise InputError(".rate: is no rate of 11g", "something else")
    assert caught.value.args == ("--rate: is no rate of 11g", "something else")


def test_help_shows_values_units_defaults_and_sources():
    assert list(descriptions(Block)) == [
        ("--standard 11a|11b", "timing (ours); default 11a"),
        ("--rate Mb/s", "of data (highest)"),
        ("--distance m", "between them (near); default 40 m"),
        ("--payload B", "of UDP (ours); default 1000 B"),
        ("--hz Hz", "(ours); default 10 Hz"),
        ("--slot us", "of the backoff (ours); default 9 us"),
        ("--queue-packets N", "that wait (ours); default 100"),
        ("--load N", "of the capacity (ours); default 0.9"),
        ("--rts", "ask first (no); default False")]
    assert list(descriptions(Fleet))[0] == ("SCENARIO", "a file")
