"""The tables of messages' time: latency and its parts by topic, and what was lost where."""

from __future__ import annotations

from desim.middleware.message_ledger import PARTS
from desim.report.campaign import formatting
from desim.report.campaign.numbers import Study
from desim.report.campaign.numbers.latencies import TopicLatency
from desim.report.campaign.tables.overview import (
    exact_vector_cells,
    exact_vector_head,
    vector_cells,
    vector_head,
)
from desim.report.campaign.tables.table import ReportTable, Shown
from desim.results.latency_by_topic import MessageAges

_MS = 1e3


def latency_table(study: Study, found: list[TopicLatency]) -> ReportTable:
    """The mean latency of each topic in each vector, and its parts."""
    parts = [part for part in map(str, PARTS) if any(part in one.parts_s for one in found)]
    rows, exact = [], []
    for one in found:
        mean, low, high = one.latency[:3] if one.latency else (None, None, None)
        n = one.latency.n if one.latency else 0
        in_ms = [None if value is None else _MS * value for value in (mean, low, high)]
        times_s = [one.parts_s.get(part, 0.0) if n else None for part in parts]
        rows.append([one.topic, *vector_cells(study, one.vector), one.delivered, in_ms[0],
                     Shown(formatting.between(*in_ms[1:]), in_ms[1]), n,
                     *(None if time_s is None else _MS * time_s for time_s in times_s)])
        exact.append([one.topic, *exact_vector_cells(study, one.vector), one.runs, one.delivered,
                      mean, low, high, n, *times_s])
    return ReportTable(
        "latency_by_topic", "Mean latency of delivered messages and its parts [ms]: means over the "
        "n runs that delivered any of a run's mean; delivered: messages a run.",
        ["topic", *vector_head(study), "delivered", "latency", "95 % interval", "n", *parts], rows,
        ["topic", *exact_vector_head(study), "ledgers", "delivered", "latency_s", "latency_low_s",
         "latency_high_s", "n", *(f"{part.replace(chr(39), '').replace(' ', '_')}_s"
                                  for part in parts)], exact)


def age_table(study: Study, found: list[TopicLatency]) -> ReportTable | None:
    """The age of messages on their arrival, from when the callback that published them was due;
    None where computers are ideal."""
    rows, exact = [], []
    for one in found:
        if one.ages_s:
            times_s = [time_s for times in one.ages_s.values() for time_s in times]
            rows.append([one.topic, *vector_cells(study, one.vector),
                         *(_MS * time_s for time_s in times_s)])
            exact.append([one.topic, *exact_vector_cells(study, one.vector), one.runs, *times_s])
    if not rows:
        return None
    steps = [step.replace("_", " ") for step in MessageAges._fields]
    return ReportTable(
        "age_by_topic", "Age of messages on their arrival [ms], since the callback was due that "
        "published them: it waited (for its node and for a processor), it computed, and they were "
        "on the way. Median and 95th percentile of a run's messages, as means over the runs.",
        ["topic", *vector_head(study), *(f"{step}, {of}" for step in steps
                                         for of in ("median", "p95"))], rows,
        ["topic", *exact_vector_head(study), "ledgers", *(
            f"{step}_{of}_s" for step in MessageAges._fields for of in ("median", "p95"))], exact)


def loss_table(study: Study, found: list[TopicLatency]) -> ReportTable | None:
    """The reasons and places of losses; None without a loss."""
    rows, exact = [], []
    for one in found:
        for lost in one.lost:
            rows.append([one.topic, *vector_cells(study, one.vector), lost.reason, lost.place,
                         lost.messages, Shown(f"{lost.share:.2%}", lost.share)])
            exact.append([one.topic, *exact_vector_cells(study, one.vector), one.runs, *lost])
    if not rows:
        return None
    return ReportTable(
        "losses_by_topic", "Lost messages by reason and place: messages a run, and their share of "
        "all messages of the topic, as means over the runs.",
        ["topic", *vector_head(study), "reason", "place", "messages", "share"], rows,
        ["topic", *exact_vector_head(study), "ledgers", "reason", "place", "messages", "share"],
        exact)
