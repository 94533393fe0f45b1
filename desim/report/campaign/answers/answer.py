"""The answer to the design's question: a plain sentence for each part of it.

A sentence says at which levels of a parameter a metric is lowest and highest, in one setting of all
other parameters; of many settings it counts them. No mean is taken over settings, because
parameters may interact, and none over runs that ended at the time limit. So the lowest mean of a
time is known where all runs of that level got there: late runs only make the others' means larger.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from typing import NamedTuple

from desim.report.campaign import formatting
from desim.report.campaign.numbers import Axis, Estimate, Estimates, Study, VectorRuns
from desim.report.campaign.numbers.contrasts import FEWEST_SEEDS, by_iteration
from desim.report.campaign.numbers.knees import LineKnees, interval
from desim.statistics.intervals import FEWEST, Interval, t_interval

_MOST_METRICS = 3
_MOST_SETTINGS = 4  # with a sentence each
_MOST_LEVELS = 3  # named in a sentence


def answer_of(study: Study, estimates: Estimates, metrics: Sequence[str],
              bends: Sequence[LineKnees]) -> list[str]:
    """The answer in sentences: of the first metric along the axis and between lines, with its
    knees, and of further ones along the axis. None for samples of a space, which have no settings
    to compare."""
    if not metrics or study.is_sampled or study.against is None:
        return []
    said = []
    for metric, axis, most in (
            (metrics[0], study.against, _MOST_SETTINGS), (metrics[0], study.by, 1),
            *((metric, study.against, 1) for metric in metrics[1:_MOST_METRICS])):
        if axis is not None and len(axis.labels) > 1:
            said += _Part(study, estimates, metric, axis).sentences(most)
    bent = [one for one in bends if one.knees and not any(
        estimates.of(metrics[0], vector).late for vector in one.line.vectors)]
    return said + [_bend(study, metrics[0], one) for one in bent if len(bends) <= _MOST_SETTINGS]


def _bend(study: Study, metric: str, one: LineKnees) -> str:
    """A sentence about the knees of a line."""
    at = [f"{formatting.quantity(knee.at, study.axis.unit)} [{interval(knee, study.axis)}]"
          for knee in one.knees]
    text = (f"{formatting.titled(metric).partition(' [')[0]} bends at {study.axis.name} "
            f"{formatting.listed(at)}.")
    return f"{one.place}: {text}" if one.place else _begun(text)


def runs_of(study: Study) -> str:
    """The runs in words: how many there are, and how many ended before the aim."""
    sizes = [len(vector.rows) for vector in study.vectors]
    runs = int(study.once.sum())
    said = [f"{formatting.counted(runs, 'run')}: "
            f"{formatting.counted(len(sizes), 'vector')} with "
            f"{'' if min(sizes) == max(sizes) else 'up to '}"
            f"{formatting.counted(max(sizes), 'seed')}{' each' if len(sizes) > 1 else ''}"
            + ("" if max(sizes) >= FEWEST_SEEDS or study.is_sampled
               else ", too few for more than a hint")]
    late = study.censored & ~study.failed & study.once
    for which, what in ((study.failed & study.once, "failed"),
                        (late & study.timed_out, "ended at the time limit"),
                        (late & ~study.timed_out, "ended before the aim for another reason")):
        if which.any():
            said.append(f"{which.sum()} of {formatting.counted(runs, 'run')} {what}")
    if len(said) == 1 and study.has_aim:
        said.append("All reached the aim" if runs > 1 else "It reached the aim")
    return ". ".join(said) + "."


class _Setting(NamedTuple):
    """The vectors along a parameter in one setting of all others, with their estimates; only those
    that have one."""

    place: str
    vectors: list[VectorRuns]
    found: list[Estimate]

    @property
    def late(self) -> int:
        return sum(one.late for one in self.found)

    def extreme(self, sign: int) -> int:
        """The index of the least mean (``sign`` 1) or of the greatest one (-1)."""
        return min(range(len(self.found)), key=lambda i: sign * (self.found[i].mean or 0.0))


class _Part:
    """A metric along one parameter."""

    def __init__(self, study: Study, estimates: Estimates, metric: str, axis: Axis) -> None:
        self._study, self._estimates, self._metric, self._axis = study, estimates, metric, axis
        self._name, _, unit = formatting.titled(metric).partition(" [")
        self._unit = f" {unit[:-1]}" if unit else ""
        self._many = self._name.partition(",")[0].endswith("s")
        self._rest = [other for other in study.axes.values()
                      if other is not axis and len(other.labels) > 1]

    def sentences(self, most: int) -> list[str]:
        """A sentence for each setting of the other parameters; of more than ``most`` one for all.
        """
        settings = [one for one in self._settings() if len(one.found) > 1]
        if len(settings) > most:
            return [_begun(self._counted(settings))]
        return [f"{one.place}: {self._said(one)}" if one.place else _begun(self._said(one))
                for one in settings]

    def _settings(self) -> list[_Setting]:
        alike: dict[tuple[int, ...], list[VectorRuns]] = {}
        for vector in sorted(self._study.vectors, key=lambda one: one.levels[self._axis.name]):
            alike.setdefault(tuple(vector.levels[other.name] for other in self._rest),
                             []).append(vector)
        made = []
        for _, vectors in sorted(alike.items()):
            place = self._study.label(vectors[0], *self._rest) if self._rest else ""
            known = {vector.number: one for vector in vectors
                     if (one := self._estimates.of(self._metric, vector)).mean is not None}
            made.append(_Setting(place, [vector for vector in vectors if vector.number in known],
                                 list(known.values())))
        return made

    def _said(self, one: _Setting) -> str:
        name, axis = self._name, self._axis.name
        low, high = one.extreme(1), one.extreme(-1)
        at, to = self._axis.label(one.vectors[low]), self._axis.label(one.vectors[high])
        if one.late:
            return self._known(one, low)
        if one.found[low].mean == one.found[high].mean:
            return (f"{name} {self._is()} the same at every {axis}: "
                    f"{self._number(one.found[low].mean)}.")
        if min(one.found[low].n, one.found[high].n) < FEWEST:
            return f"{self._lowest(one, low)} and highest at {to}{self._value(one.found[high])}."
        apart = self._apart(one, low, high)
        text = f"{self._number(apart.mean)} apart{_range(apart)}"
        if apart.low is not None and apart.low <= 0.0:
            return (f"{name} {'do' if self._many else 'does'} not differ clearly by {axis}: {at} "
                    f"and {to} lie {text}.")
        return f"{name} {self._is()} lowest at {axis} = {at} and highest at {to}: {text}."

    def _known(self, one: _Setting, low: int) -> str:
        """A sentence on a setting in which runs ended at the time limit."""
        first = (f"where {self._name} {self._is()} lowest is not known"
                 if one.found[low].late else self._lowest(one, low) + self._unclear(one, low))
        runs = sum(each.n for each in one.found)
        if one.late == runs:
            return f"{first}. All {runs} runs ended at the time limit."
        none = [self._axis.label(vector) for vector, each in zip(one.vectors, one.found,
                                                                 strict=True)
                if each.late == each.n]
        among = f", among them all at {formatting.listed(none)}" if none else ""
        return f"{first}. {one.late} of {runs} runs ended at the time limit{among}."

    def _lowest(self, one: _Setting, low: int) -> str:
        return (f"{self._name} {self._is()} lowest at {self._axis.name} = "
                f"{self._axis.label(one.vectors[low])}{self._value(one.found[low])}")

    def _unclear(self, one: _Setting, low: int) -> str:
        """The other levels that all runs reached, too, and whose means may as well be lowest."""
        near = [self._axis.label(vector) for i, vector in enumerate(one.vectors)
                if i != low and not one.found[i].late
                and (apart := self._apart(one, low, i)).low is not None and apart.low <= 0.0]
        return f", not clearly lower than at {formatting.listed(near)}" if near else ""

    def _counted(self, settings: list[_Setting]) -> str:
        """A sentence on the levels with the lowest mean in many settings."""
        lowest = Counter[str]()
        same = unknown = 0
        for one in settings:
            low, high = one.extreme(1), one.extreme(-1)
            if one.found[low].late:
                unknown += 1
            elif one.found[low].mean == one.found[high].mean:
                same += 1
            else:
                lowest[self._axis.label(one.vectors[low])] += 1
        kinds = [(f"at {level}" if i else f"lowest at {self._axis.name} = {level}", count)
                 for i, (level, count) in enumerate(lowest.most_common(_MOST_LEVELS))]
        kinds += [(f"the same at every {self._axis.name}", same)] if same else []
        kinds += [("not known, because runs ended at the time limit,", unknown)] if unknown else []
        said = [f"{what} in {count if i else _of(count, len(settings))}"
                for i, (what, count) in enumerate(kinds)]
        said[0] += (f" {'levels' if len(self._rest) == 1 else 'combinations'} of "
                    f"{formatting.listed([axis.name for axis in self._rest])}")
        return (f"{self._name} {self._is()} {formatting.listed(said)}."
                + (" They differ, so that no pooled answer exists." if len(lowest) > 1 else ""))

    def _apart(self, one: _Setting, low: int, high: int) -> Interval:
        """The difference of a higher mean and the lowest one, seed by seed; the level of its
        interval allows for the choice among all pairs (Bonferroni)."""
        if not self._study.is_paired:
            return Interval((one.found[high].mean or 0.0) - (one.found[low].mean or 0.0), None,
                            None, 0, "none")
        first, second = (by_iteration(self._study, self._estimates, self._metric,
                                      one.vectors[end]) for end in (low, high))
        pairs = len(one.found) * (len(one.found) - 1) / 2
        return t_interval([second[k] - first[k] for k in sorted(first.keys() & second.keys())],
                          1 - 0.05 / pairs)

    def _value(self, one: Estimate) -> str:
        """A mean with its range; of fewer runs than an interval needs the values themselves."""
        if one.n < FEWEST:
            values = [formatting.number(value, 3) for value in one.values]
            return f" ({formatting.listed(values)}{self._unit})"
        return f", {self._number(one.mean)}{_range(one)}"

    def _number(self, value: float | None) -> str:
        return f"{formatting.number(value, 3)}{self._unit}"

    def _is(self) -> str:
        return "are" if self._many else "is"


def _of(count: int, total: int) -> str:
    return f"all {total}" if count == total else f"{count} of {total}"


def _begun(sentence: str) -> str:
    return sentence[0].upper() + sentence[1:]


def _range(one: Estimate | Interval) -> str:
    return "" if one.low is None or one.high is None or one.low == one.high \
        else f" {formatting.between(one.low, one.high)}"
