"""A comparison on every rung of the fidelity ladder, as a design made in memory, not a file."""

from __future__ import annotations

from collections.abc import Sequence

from desim.campaign.design.columns import FIXED
from desim.campaign.design.design import LoadedDesign
from desim.campaign.design.varied import Varied, designed, name_of, stem, varied
from desim.scenario.source_places import SourcePlace

RUNGS = ("ideal", "disk", "walls", "mac", "multihop")  # the last one is the highest
FIDELITY = "network.fidelity"
RUNG = "rung"  # the parameter
COMPARED = "coordination.strategy=nearest_frontier,random_frontier"


def ladder_design(scenario: str, compare: str = COMPARED, seeds: int = 5,
                  metric: str | None = None, overrides: Sequence[str] = ()) -> LoadedDesign:
    """A design of all rungs and the values of ``A.B.C=V1,V2,...``, with ``overrides`` (``A.B.C=V``)
    in every run, ranked by ``metric`` (None: by what leads the task). Raises ``InputError``."""
    compared = varied("--compare", compare, COMPARED)
    name = name_of(compared.key, [compared.key], (*FIXED, RUNG))
    rungs = Varied(FIDELITY, list(RUNGS), SourcePlace("desim ladder"))
    return designed("desim ladder", scenario, {RUNG: rungs, name: compared}, overrides, {
        "name": f"ladder_{stem(scenario)}_{name}",
        "question": f"Which of {' and '.join(compared.labels)} ({compared.key}) is better, and "
                    "does the answer depend on how true to life the network is?",
        "iterations": seeds, "report": {"against": RUNG, "by": name} | (
            {} if metric is None else {"metrics": [metric]})})
