"""The media of the judge's networks, as in a scenario."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

Rule = dict[str, object]

_CHANNELS = (*range(36, 65, 4), *range(100, 145, 4), *range(149, 166, 4))  # 20 MHz in 5 GHz


class JudgedMedium(NamedTuple):
    """A network model with its parameters, and the rules in front of it."""

    model: Mapping[str, object]
    rules: Sequence[Rule]


def wire(rate_mbps: float, way_ms: float, rules: Sequence[Rule] = ()) -> JudgedMedium:
    """A link for each host, of this rate and delay."""
    return JudgedMedium({"model": "link", "rate": f"{rate_mbps:g} Mb/s",
                         "latency": f"{way_ms:g} ms"}, rules)


def lan(delay: str = "50 us", rules: Sequence[Rule] = ()) -> JudgedMedium:
    """A network with a delay and nothing else."""
    return JudgedMedium({"model": "ideal", "delay": delay}, rules)


def radio(number: int, rules: Sequence[Rule] = ()) -> JudgedMedium:
    """802.11a at 24 Mb/s; radios of different numbers do not hear each other."""
    return JudgedMedium({"model": "radio", "standard": "11a", "rate": "24 Mb/s",
                         "channel": _CHANNELS[number]}, rules)


def weak_radio(number: int) -> JudgedMedium:
    """The same of 1 mW."""
    model, rules = radio(number)
    return JudgedMedium({**model, "power": "0 dBm"}, rules)


def access_point(number: int) -> JudgedMedium:
    """802.11g with an access point in the middle of the hosts."""
    return JudgedMedium({"model": "radio", "standard": "11g", "rate": "24 Mb/s",
                         "access_points": [{"at": ["20 m", "20 m"], "channel": 1 + 5 * number}],
                         "infrastructure": {}}, [])


def lost(share: float, from_s: float = 0.0) -> list[Rule]:
    """Loss of each packet by chance, from an instant on; on a radio, of each transmission."""
    begin = {"from": f"{from_s} s"} if from_s else {}
    return [{"rule": "loss", "probability": share, **begin}] if share else []


def cut(from_s: float, until_s: float, pattern: str) -> list[Rule]:
    """A cut between the hosts of ``pattern`` and all others."""
    return [{"rule": "partition", "groups": [[pattern]], "from": f"{from_s} s",
             "until": f"{until_s} s"}]
