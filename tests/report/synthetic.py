"""Campaigns that nobody ran: a design, and a table of runs as ``desim sweep`` writes it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from itertools import product
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq

from desim.campaign.design.design import Design
from desim.campaign.design.quantities import as_numbers

LIMIT_S = 1000.0
Row = dict[str, Any]


def design(parameters: Mapping[str, list], **more: Any) -> Design:
    """By its parameters' values."""
    return Design.model_validate({
        "name": "made_up", "base": "small.yaml", "question": "Does <it> pay off & when?",
        "parameters": {name: {"key": f"fleet.{name}", "values": values}
                       for name, values in parameters.items()}, **more})


def campaign(folder: Path, parameters: Mapping[str, list], iterations: int,
             outcome: Callable[[Mapping[str, Any], int], Row]) -> Path:
    """``outcome(levels, iteration)`` gives a run's metrics, or ``{"error": ...}``."""
    rows = []
    for number, levels in enumerate(product(*parameters.values())):
        values = dict(zip(parameters, levels, strict=True))
        for iteration in range(iterations):
            found = outcome(values, iteration)
            rows.append({"run_id": f"{number:06d}{iteration:06d}", "vector": number,
                         "iteration": iteration, "seed": 1 + iteration,
                         "status": "failed" if "error" in found else "finished",
                         "error": found.get("error"), "digest": None, **values,
                         **{name: value for name, value in found.items() if name != "error"}})
    return write(folder, parameters, rows)


def write(folder: Path, parameters: Mapping[str, list], rows: list[Row]) -> Path:
    """The table, with columns as ``desim.campaign.folder.table`` makes them."""
    names = list(dict.fromkeys(name for row in rows for name in row))
    columns = {}
    for name in names:
        column = [row.get(name) for row in rows]
        numbers = as_numbers(column) if name in parameters else None
        if numbers and numbers[0]:
            columns[name], columns[name + numbers[0]] = column, numbers[1]
        elif numbers:
            columns[name] = numbers[1]
        else:
            columns[name] = column
    fixed = {"error": pa.string(), "digest": pa.string()}
    pq.write_table(pa.table({name: pa.array(column, fixed.get(name))
                             for name, column in columns.items()}), folder / "runs.parquet")
    return folder


def timed(time_s: float | None, **more: Any) -> Row:
    """A run that explored within the limit, or was stopped there."""
    return {"simulated_s": LIMIT_S if time_s is None else time_s, "censored": time_s is None,
            "exploration_time_s": time_s, **more}
