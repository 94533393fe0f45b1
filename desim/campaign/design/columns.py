"""The columns of ``runs.parquet`` that are not metrics: the run's identity and its parameters."""

from __future__ import annotations

from collections.abc import Collection, Mapping

from desim.campaign.design.plan import Plan
from desim.campaign.design.quantities import as_numbers

DESIM = "desim"  # version, and the hash of the source
FIXED = ("run_id", "vector", "iteration", "seed", "status", "error", "digest", DESIM)


def labelled(plan: Plan, name: str) -> dict[str, Mapping[str, object]]:
    """The columns of a parameter, each a mapping from a level's label to the column's value.

    One column of numbers where all levels are bare numbers; else one of words, and where these are
    quantities, another of numbers in one unit (``bandwidth``, ``bandwidth_bps``).
    """
    values = {vector.levels[name].label: vector.levels[name].value for vector in plan.vectors}
    words = {label: label for label in values}
    numbers = as_numbers(list(values.values()))
    if numbers is None:
        return {name: words}
    if all(isinstance(value, int) for value in values.values()):
        return {name: values}
    suffix, scaled = numbers
    of = dict(zip(values, scaled, strict=True))
    return {name: words, name + suffix: of} if suffix else {name: of}


def refuse_twins(plan: Plan, metrics: Collection[str]) -> None:
    """Refuse two columns of one name. Raises ``InputError``."""
    for name in plan.design.metrics:
        if name in FIXED:
            raise plan.loaded.wrong(("metrics", name), "is a column that runs.parquet always has; "
                                                       "choose another name")
    whose = dict.fromkeys(metrics, "a metric") | dict.fromkeys(FIXED, "every campaign")
    for name in plan.parameters:
        for column in labelled(plan, name):
            if column in whose:
                raise plan.loaded.wrong(("parameters", name), (
                    f"{column} is a column of {whose[column]} in runs.parquet, too; choose another "
                    "name"))
            whose[column] = f"the parameter {name}"
