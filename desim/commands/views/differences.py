"""The first difference between two runs, and whether a run repeats itself."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from pathlib import Path

from desim import api
from desim.results.comparison import ComparedRuns
from desim.results.file_names import TRACE
from desim.results.folder import RunFolder
from desim.results.run import Run
from desim.results.trace_words import text
from desim.results.traces import (
    CONTEXT,
    Rows,
    Spool,
    first_difference,
    refuse_failed,
    simulated,
    spools,
    trace_of,
)
from desim.scenario.load import Loaded
from desim.simulation.simulation import Simulation

_SHOWN = 12  # entities: a line


def checked(loaded: Loaded, out: Path, watch: api.Watch | None,
            command: str) -> tuple[Run, str | None]:
    """Run twice. Returns the first run, and its first difference from the second in words; None if
    they are equal."""
    names: dict[int, str] = {}

    @contextmanager
    def noting(simulation: Simulation, folder: RunFolder) -> Iterator[None]:
        with watch(simulation, folder) if watch else nullcontext():
            yield
        names.update(simulation.names.items())

    with spools() as folder:
        spool = Spool(folder / "first")
        run = api.run(loaded, out=out, watch=noting, rows=spool.add, command=command)
        again = simulated(loaded.scenario, folder / "second")
        return run, _difference(Rows(spool.rows(), names), again, "first run", "second run")


def difference(first: Path, second: Path, trust: bool) -> str | None:
    """The first difference between two runs, in words; None if their traces and poses are equal.

    Where rows were not kept, the scenario is run again. Raises ``InputError`` for a failed run.
    """
    runs = Run(first, trust), Run(second, trust)
    for run in runs:
        refuse_failed(run)
    for run in runs:
        if run.keeps(TRACE):
            run.file(TRACE)  # what is equal is the rows, as far as they are there
    digests = [run.manifest["digest"] for run in runs]
    if digests[0] is not None and digests[0] == digests[1]:
        parted = ComparedRuns(*runs).parted
        return None if parted is None else (
            f"the digests are equal, but poses are not: {parted.robot} parts at {parted.time_s:g} "
            f"s, by {parted.apart_m:.3g} m; a folder was changed")
    with spools() as folder:
        one, other = (trace_of(run, folder / str(i)) for i, run in enumerate(runs))
        row = _difference(one, other, str(first), str(second))
    if row is None:
        return ("the digests differ, but the rows are equal now; the runs were made with "
                "other versions, or on other machines (see their manifests)")
    entities, others = (run.manifest.get("digest_by_entity", {}) for run in runs)
    unlike = [name for name in sorted(entities | others) if entities.get(name) != others.get(name)]
    shown = ", ".join(unlike[:_SHOWN]) + (", ..." if len(unlike) > _SHOWN else "")
    return f"{len(unlike)} of {len(entities | others)} entities differ: {shown}\n{row}"


def _difference(one: Rows, other: Rows, name: str, other_name: str) -> str | None:
    at = first_difference(one.rows, other.rows)
    if at is None:
        return None
    begin = max(0, at - CONTEXT)
    lines = [f"row {at} is the first that differs; before it:" if at else
             "row 0 is the first that differs"]
    lines += [f"    {text(row, one.names)}" for row in one.rows[begin:at]]
    for side, title in ((one, name), (other, other_name)):
        lines.append(f"from there on, {title}:")
        rows = side.rows[at:at + CONTEXT + 1]
        lines += [f"  {'>' if i == 0 else ' '} {text(row, side.names)}"
                  for i, row in enumerate(rows)] or ["  > (it ends here)"]
    return "\n".join(lines)
