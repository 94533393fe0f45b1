"""The values that a metric can have: an interval of its mean does not reach beyond."""

from __future__ import annotations

import math
import re

import numpy as np

from desim.report.campaign.numbers.study import Study

Bounds = tuple[float, float]

ANY: Bounds = (-math.inf, math.inf)
_COUNT: Bounds = (0.0, math.inf)
_SHARE: Bounds = (0.0, 1.0)
# The paper's equations 3 and 5 subtract: many collisions and bad maps give less than zero.
_KNOWN = {"map_quality": (-math.inf, 1.0), "safety": (-math.inf, 1.0),
          **dict.fromkeys(("map_completeness", "explored", "explored_union", "explored_all"),
                          _SHARE)}
_NAME = re.compile(r"[A-Za-z_]\w*")
_QUOTIENT = re.compile(r"\s*\w+\s*/\s*(\w+|\([^()]*\))\s*")


def of(study: Study, metric: str) -> Bounds:
    """The least and the greatest value of a metric. Times and counts are not negative, and a time
    is not above its limit (see ``Estimates``). An expression of the design is not negative if it
    only adds, multiplies and divides values that are not negative; a quotient that is at most 1 in
    all runs is a share. ``ANY`` if nothing is known."""
    formula = study.design.metrics.get(metric)
    if formula is None:
        return _of_run(metric)
    names = _NAME.findall(formula)
    if "-" in formula or ":" in formula or any(_of_run(name)[0] < 0 for name in names):
        return ANY
    is_share = _QUOTIENT.fullmatch(formula) \
        and not np.nanmax(study.column(metric), initial=0.0) > 1.0
    return _SHARE if is_share else _COUNT


def _of_run(metric: str) -> Bounds:
    """The bounds of a metric of every run."""
    return _KNOWN.get(metric, _SHARE if metric.endswith(("_percent", "_share")) else _COUNT)
