"""The ledger of a run, kept or made again: where each message's time went."""

from __future__ import annotations

import pyarrow as pa
import pyarrow.parquet as pq

from desim.errors import InputError
from desim.results.ledger_recorder import LEDGER, SCHEMA, LedgerRecorder
from desim.results.run import Run, readable
from desim.results.status import RunStatus
from desim.results.traces import complete, repeatable
from desim.simulation.simulation import Simulation
from desim.units import NS_PER_S


def ledger_of(run: Run) -> pa.Table:
    """The ledger of a run, of schema ``SCHEMA``, a row for each message between hosts and receiver
    in the order of their fates: the kept one, or that of running its scenario again. Raises
    ``InputError`` where it was not kept and the run cannot be repeated."""
    if run.has(LEDGER):
        with readable(run.file(LEDGER)) as file:
            return pq.read_table(file).cast(SCHEMA)
    complete(run)
    scenario = repeatable(run, "messages' parts of time", "trace.ledger=true")
    recorder = LedgerRecorder()
    simulation = Simulation(scenario, trace_sink=recorder.sink, ledger=recorder.messages)
    outcome = simulation.run(round(run.manifest["simulated_s"] * NS_PER_S))
    if run.manifest["status"] == RunStatus.FINISHED \
            and outcome.digest != run.manifest["digest"]:
        raise InputError(f"{run.path}: the run does not repeat itself: its digest is "
                         f"{run.manifest['digest']}, now {outcome.digest}; desim diff tells more")
    return recorder.table(simulation.names, [host.name for host in simulation.graph.hosts])
