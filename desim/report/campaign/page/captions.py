"""The captions of figures, and how to read the figures."""

from __future__ import annotations

from desim.report.campaign import wording
from desim.report.campaign.numbers.estimates import Estimates
from desim.report.campaign.numbers.study import TIMES, Study, VectorRuns
from desim.report.campaign.page import page


def reading(study: Study) -> str:
    """A paragraph on reading the figures of all metrics, as HTML."""
    if study.is_sampled:
        return ""
    text = ("Lines and large symbols are means over the runs of a vector, bars their 95 % "
            "intervals, faint dots single runs (▲: stopped at the time limit).")
    if len({int(study.reached[vector.rows].sum()) for vector in study.vectors}) > 1:
        text += " The larger a symbol, the more runs reached the aim; hollow: none did."
    if study.others:
        text += (f" Panels are the levels of "
                 f"{wording.listed([axis.name for axis in study.others])}.")
    return page.paragraph(text, "note")


def caption(study: Study, estimates: Estimates, metric: str, vectors: list[VectorRuns]) -> str:
    """The caption of a metric's figure that shows ``vectors``."""
    found = [estimates.of(metric, vector) for vector in vectors]
    finished = sum(one.runs - one.failed for one in found)
    have = sum(one.n for one in found)
    text = f"{wording.titled(metric)} against {study.against.name}. " if study.against \
        else f"{wording.titled(metric)}. "
    if any(one.late for one in found):
        text += ("Mean restricted to the time limit: a run that was stopped counts with the "
                 "limit. Dotted: the mean of the successes, which leaves such runs out. ")
    if have < finished:
        text += f"{finished - have} of {finished} finished runs have no such value"
        text += (", or are of a vector of which some runs were stopped before it for another "
                 "reason than the time limit. ") if metric in TIMES else ". "
    return text
