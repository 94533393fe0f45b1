"""A report shows first what leads the task of its runs, unless its design names metrics."""

import pytest
from designs import Here, planned

from desim.campaign.design.design import read_design
from desim.campaign.design.ladder import ladder_design
from desim.campaign.design.metrics import Metrics
from desim.campaign.running.sweep import Sweep
from desim.errors import InputError
from desim.report.campaign.campaign_report import write
from desim.report.campaign.numbers import Study

IDLENESS = ("idleness_mean_s", "idleness_worst_s")
SIZES = "parameters: {robots: {key: fleet.size, values: [1, 2]}}\niterations: 2\n"
PATROL = f"set: {{task: {{model: patrolling, drawn: 3}}}}\n{SIZES}"
BOTH = "parameters: {work: {key: task, values: [patrolling, exploration]}}\niterations: 1\n"
ORDERED = '''
from desim import ports


class Ordered:
    """Nothing to do."""

    class Params(ports.Params):
        """None."""

    leads = ("order",)

    def __init__(self, params):
        pass

    def start(self, context):
        pass

    def metrics(self):
        return {"chaos": 2.0, "order": 1.0}
'''


def swept(folder, text):
    plan = planned(folder, text)
    with Sweep(plan, Metrics(plan), folder / "out") as sweep:
        sweep.run(Here())
    return plan


@pytest.mark.parametrize("text, led", [
    (SIZES, ("exploration_time_s",)),
    (PATROL, IDLENESS),
    (BOTH, (*IDLENESS, "exploration_time_s")),
    (f"{PATROL}report: {{metrics: [visits]}}\n", ("visits",)),
    (f"{BOTH}report: {{metrics: [exploration_time_s, rounds]}}\n",
     ("exploration_time_s", "rounds")),
])
def test_a_plan_shows_what_leads_its_tasks(tmp_path, text, led):
    plan = planned(tmp_path, text)
    assert plan.design.report.metrics == plan.loaded.design.report.metrics == led
    Metrics(plan)  # there are such metrics


def test_a_metric_of_no_run_is_still_refused(tmp_path):
    plan = planned(tmp_path, f"{PATROL}report: {{metrics: [exploration_time_s]}}\n")
    with pytest.raises(InputError, match="no run has a number 'exploration_time_s'"):
        Metrics(plan)


def test_the_report_of_a_patrol_is_about_idleness(tmp_path):
    plan = swept(tmp_path, PATROL)
    assert read_design(str(tmp_path / "out" / "design.yaml"))[0].report == plan.design.report
    page = write(tmp_path / "out", plan.design).read_text()
    assert page.index('id="metric-idleness_mean_s"') < page.index('id="metric-idleness_worst_s"')
    assert "metric-exploration_time_s" not in page
    assert (tmp_path / "out" / "report" / "figures" / "idleness_mean_s.svg").is_file()


@pytest.mark.parametrize("text, led", [(SIZES, ("exploration_time_s",)), (PATROL, IDLENESS)])
def test_a_report_with_a_design_that_names_none_asks_the_table(tmp_path, text, led):
    swept(tmp_path, text)
    written = read_design(str(tmp_path / "design.yaml"))[0]
    assert written.report.metrics == ()
    assert Study(tmp_path / "out", written).design.report.metrics == led


def test_a_task_of_ones_own_leads_with_what_it_declares(tmp_path):
    (tmp_path / "ordered.py").write_text(ORDERED)
    plan = planned(tmp_path, f"set: {{task: 'ordered:Ordered'}}\n{SIZES}")
    assert plan.design.report.metrics == ("order",)
    Metrics(plan)


def test_a_task_that_leads_with_nothing_is_refused(tmp_path):
    (tmp_path / "aimless.py").write_text(ORDERED.replace('("order",)', "()"))
    with pytest.raises(InputError, match=r"must declare leads = \('...',\), a tuple of names, not "
                                         r"\(\)"):
        planned(tmp_path, f"set: {{task: 'aimless:Ordered'}}\n{SIZES}")


def test_a_ladder_ranks_by_what_leads(repository):
    patrol = str(repository / "scenarios" / "patrol.yaml")
    compare = "coordination.strategy=cyclic_patrol,expected_reactive"
    assert ladder_design(patrol, compare).design.report.metrics == ()
    assert ladder_design(patrol, compare, metric="visits").design.report.metrics == ("visits",)
