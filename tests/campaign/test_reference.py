"""Reference designs: what each vector is called, and which designs are none."""

import json

import pyarrow.parquet as pq
import pytest
from designs import planned, row, written

import desim
from desim.campaign.design.design import load_design, read_design
from desim.campaign.design.metrics import Metrics
from desim.campaign.design.plan import Plan
from desim.campaign.design.reference import ReferenceDesign
from desim.campaign.folder.design_copy import store
from desim.campaign.folder.table import REFERENCE, write_table
from desim.campaign.running.agenda import Agenda
from desim.results.identity import Identity

TEXT = """reference: {version: 3}
parameters:
  who:
    levels:
      mine: {coordination.strategy: random_frontier}
      led:
        coordination.strategy: centralized
        hosts.base: {strategy: {strategy: centralized}, at: [-4 m, 4 m]}
  rate: {key: network.media.lan.rate, values: [1 Gb/s, 1 Mb/s]}
  sent: {key: coordination.exchange.period, values: [5 s]}
set: {network.media: {lan: {model: switch}}}
iterations: 1
"""


def names(plan: Plan) -> list[dict[str, str]]:
    """Of each vector."""
    return [plan.reference.names({name: level.label for name, level in vector.levels.items()})
            for vector in plan.vectors]


def test_parameters_have_roles_and_the_base_has_the_rest(tmp_path):
    plan = planned(tmp_path, TEXT)
    assert plan.reference == ReferenceDesign(
        "d", 3, {"strategy": ["who"], "network": ["rate", "sent"]},
        {"terrain": "small", "robots": "2"})
    assert names(plan) == [
        {"terrain": "small", "robots": "2", "network": f"{rate}, 5 s", "strategy": who}
        for who in ("mine", "led") for rate in ("1 Gb/s", "1 Mb/s")]


def test_what_nothing_varies_is_called_as_in_the_scenario(tmp_path):
    plan = planned(tmp_path, """reference: {version: 1}
parameters: {robots: {key: fleet.size, values: [1, 2]}}
set: {environment: {terrain: maze}, fleet.start: {from: [-38 m, 38 m], step: [0 m, -2 m]},
      deployment: field, network.media: {a: {model: switch}, b: {model: ideal}}}
""")
    assert plan.reference.fixed == {"terrain": "maze", "network": "field: a + b",
                                    "strategy": "nearest_frontier"}
    assert [found["robots"] for found in names(plan)] == ["1", "2"]


def test_a_design_without_the_key_is_none(tmp_path):
    assert planned(tmp_path, "").reference is None


@pytest.mark.parametrize("own, version", [("", None), ("reference: {version: 4}\n", 4),
                                          ("reference: null\n", None)])
def test_a_design_that_extends_one_is_one_only_if_it_says_so(tmp_path, own, version):
    written(tmp_path, TEXT)
    (tmp_path / "other.yaml").write_text(f"extends: design.yaml\n{own}seed: 7\n")
    design, _ = read_design(str(tmp_path / "other.yaml"))
    assert design.seed == 7 and design.name == "d"
    assert (design.reference and design.reference.version) == version


def test_the_copy_in_the_campaigns_folder_is_the_same(tmp_path):
    plan = planned(tmp_path, TEXT)
    (tmp_path / "out").mkdir()
    store(plan.loaded, tmp_path / "out")
    assert Plan(load_design(tmp_path / "out" / "design.yaml")).reference == plan.reference


def test_the_table_says_which_it_is_and_what_made_each_run(tmp_path):
    plan = planned(tmp_path, TEXT)
    metrics, agenda = Metrics(plan), Agenda(plan, {})
    for _, _, run_id in agenda.runs:
        agenda.add(row(run_id, explored=1.0))
    write_table(tmp_path / "runs.parquet", plan, metrics, agenda.rows, agenda.runs)
    table = pq.read_table(tmp_path / "runs.parquet")
    assert ReferenceDesign(**json.loads(table.schema.metadata[REFERENCE.encode()])) \
        == plan.reference
    assert table["desim"].to_pylist() == [
        f"{desim.__version__} {Identity(plan.scenario(vector, 0).scenario).source}"
        for vector in plan.vectors]
