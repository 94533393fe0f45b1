"""The latency of a campaign's messages by topic and vector: mean parts, and what was lost."""

from __future__ import annotations

import math
import os
from functools import cache, partial
from typing import NamedTuple

import numpy as np

from desim.errors import InputError
from desim.ports import natural_key
from desim.report.campaign.numbers.estimates import Estimates
from desim.report.campaign.numbers.study import Study, VectorRuns
from desim.results.file_names import LEDGER_TOPICS
from desim.results.latency_by_topic import (
    MessageAges,
    TopicBreakdown,
    TopicBreakdowns,
    from_json,
    without_numbers,
)
from desim.results.run import Run, readable
from desim.results.seal import parsed
from desim.statistics.intervals import Interval

_NONE = TopicBreakdown(0, 0, {}, ())


class MeanLoss(NamedTuple):
    """Messages that were lost for a reason at a place: their number, and their share of all of
    their topic, as means over the runs. Numbered hosts are one place, ``robot_*``."""

    reason: str
    place: str
    messages: float
    share: float


class TopicLatency(NamedTuple):
    """A family of topics in the ``runs`` of a vector that kept a ledger: how many messages were
    ``delivered`` and what was ``lost`` in the mean of these. The ``latency`` (s) and its
    ``parts_s`` are the means of the runs' means, over those that delivered any; None and empty
    without such a run. ``ages_s``: the median and the 95th percentile (s) of each step of the
    messages' age, as means over the runs that have them; empty where computers are ideal."""

    vector: VectorRuns
    topic: str
    runs: int
    delivered: float
    latency: Interval | None
    parts_s: dict[str, float]
    lost: tuple[MeanLoss, ...]
    ages_s: dict[str, tuple[float, float]]


def by_topic_and_vector(study: Study, estimates: Estimates) -> list[TopicLatency]:
    """The latencies of all vectors; none where no run has kept its ledger."""
    found, ids = [], study.text("run_id")
    read = cache(partial(_read, study))  # vectors may share runs
    for vector in study.vectors:
        runs = [run for row in vector.rows[~study.failed[vector.rows]]
                if (run := read(ids[row])) is not None]
        found += [_mean(vector, topic, [run.get(topic, _NONE) for run in runs], estimates)
                  for topic in sorted({topic for run in runs for topic in run})]
    return sorted(found, key=lambda one: (natural_key(one.topic), one.vector.number))


def _read(study: Study, run_id: str) -> TopicBreakdowns | None:
    """A run's latencies: None without a ledger, and of a damaged one."""
    folder = study.run_folders.get(run_id)
    if folder is None or not os.path.lexists(folder / LEDGER_TOPICS):
        return None
    try:
        text = Run(folder).content(LEDGER_TOPICS)
        with readable(folder / LEDGER_TOPICS):
            return from_json(parsed(text))
    except InputError:
        return None


def _mean(vector: VectorRuns, topic: str, runs: list[TopicBreakdown], estimates: Estimates,
          ) -> TopicLatency:
    arrived = [one for one in runs if one.delivered]
    parts = dict.fromkeys(part for one in arrived for part in one.times_ns)
    means = {part: float(np.mean([one.times_ns.get(part, 0) / one.delivered / 1e9
                                  for one in arrived])) for part in parts}
    latency = estimates.interval(
        np.array([one.latency_ns / one.delivered / 1e9 for one in arrived])
    ).within(0.0, math.inf) if arrived else None
    return TopicLatency(vector, topic, len(runs),
                        float(np.mean([one.delivered for one in runs])), latency, means,
                        _losses(runs), _ages(runs))


def _ages(runs: list[TopicBreakdown]) -> dict[str, tuple[float, float]]:
    steps = [one.ages._asdict() for one in runs if one.ages is not None]
    return {step: (float(np.mean([ages[step].median_ns for ages in steps])) / 1e9,
                   float(np.mean([ages[step].p95_ns for ages in steps])) / 1e9)
            for step in MessageAges._fields} if steps else {}


def _losses(runs: list[TopicBreakdown]) -> tuple[MeanLoss, ...]:
    """The most frequent first."""
    messages: dict[tuple[str, str], float] = {}
    share: dict[tuple[str, str], float] = {}
    for one in runs:
        for lost in one.lost:
            where = lost.reason, without_numbers(lost.place)
            own = lost.messages / len(runs)
            messages[where] = messages.get(where, 0.0) + own
            share[where] = share.get(where, 0.0) + own / (one.delivered + one.dropped)
    return tuple(sorted((MeanLoss(*where, messages[where], share[where]) for where in messages),
                        key=lambda loss: (-loss.messages, loss.reason, loss.place)))
