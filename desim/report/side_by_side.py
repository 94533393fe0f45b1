"""The words and cells of two runs side by side, for terminals and notebooks."""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator

from desim.results.comparison import ComparedRuns, KeyDifference, MetricPair

_DIGITS = 6  # of a number


def key_rows(keys: Iterable[KeyDifference]) -> Iterator[tuple[str, str, str]]:
    """Each key with both of its values."""
    for key in keys:
        yield key.key, value(key.first), value(key.second)


def metric_cells(pair: MetricPair) -> tuple[str, str, str, str]:
    """Both values, their difference and its share of the first one in percent."""
    change, percent = pair.difference, pair.percent
    shown = "" if change is None else \
        f"{change:+d}" if isinstance(change, int) else f"{change:+.{_DIGITS}g}"
    share = "" if percent is None else f"{percent:+.1f}"
    return value(pair.first), value(pair.second), shown, share


def value(given: object) -> str:
    """A value of a scenario or a summary: as YAML would have it, numbers with six digits."""
    if given is None:
        return "-"
    if isinstance(given, float):
        return f"{given:.{_DIGITS}g}"
    return given if isinstance(given, str) else json.dumps(given, default=str)


def outcome(found: ComparedRuns) -> str:
    """The outcome besides the tables, as one sentence without its full stop."""
    if found.failed:
        return "; ".join(f"{run.path} failed: {run.manifest.get('error')}" for run in found.failed)
    equal = sum(pair.is_equal for pair in found.metrics)
    return f"{equal} metrics are equal; {_parting(found)}"


def _parting(found: ComparedRuns) -> str:
    """Whether and when the robots of two runs part, as part of a sentence."""
    if found.is_same:
        return "the digests, too: everything that happened is the same"
    if found.parted is None:
        one, other = found.robots
        return ("every robot that both have is at the same places" if one & other else
                "no robot has the same name in both" if one and other else
                "neither has robots" if one == other else "only one of them has robots")
    parted = found.parted
    how = f"elsewhere, by {parted.apart_m:.3g} m" if parted.apart_m else "turned otherwise"
    return f"at {parted.time_s:g} s {parted.robot} is the first to be {how}"
