"""Plug-ins that a user writes: a module beside the scenario that names it."""

import pickle
import re
import subprocess
import sys
import textwrap

import pytest

from desim import plugins
from desim.errors import InputError
from desim.scenario.load import from_mapping, load
from desim.scenario.resolved import resolved, scenario_id
from desim.testing import ImmediateNetwork

# Every test has modules of its own: Python keeps what it has imported by name.
MODEL = """
    from desim import ports
    from {helper} import DELAY_NS

    class Slow:
        class Params(ports.Params):
            '''None.'''
        reasons = ()
        def __init__(self, params): pass
        def start(self, context, hosts): self.context = context
        def send(self, frame):
            self.context.settle_many(frame, frame.receivers, ports.Deliver(DELAY_NS))

    def enough(quantities):
        return quantities["time_s"] > 3
"""


@pytest.fixture(autouse=True)
def here(tmp_path, monkeypatch):
    (tmp_path / "study").mkdir()
    (tmp_path / "elsewhere").mkdir()
    monkeypatch.chdir(tmp_path / "elsewhere")
    monkeypatch.setattr(sys, "path", list(sys.path))
    return tmp_path


def written(folder, name, delay_ns=5):
    """A module called ``name`` with its helper, and a scenario ``case.yaml`` that names it."""
    folder.mkdir(exist_ok=True, parents=True)
    (folder / f"{name}_helper.py").write_text(f"DELAY_NS = {delay_ns}\n")
    (folder / f"{name}.py").write_text(textwrap.dedent(MODEL.format(helper=f"{name}_helper")))
    (folder / "case.yaml").write_text(
        f"name: x\nnetwork: {{media: {{lan: {{model: '{name}:Slow'}}}}}}\n"
        f"stop: {{when: '{name}:enough'}}\n")


def model(scenario):
    """The class of the medium called lan."""
    return plugins.load("network", scenario.network.media["lan"].model)


def delay_ns(scenario):
    return sys.modules[model(scenario).__module__].DELAY_NS


def test_a_module_beside_the_scenario_is_found_from_anywhere(here):
    written(here / "study", "my_slow")
    scenario = load("../study/case.yaml").scenario
    assert scenario.network.media["lan"].model == f"{here}/study/my_slow:Slow"
    assert scenario.stop.when == f"{here}/study/my_slow:enough"
    assert delay_ns(scenario) == 5


def test_the_scenarios_folder_goes_before_the_current_one(here):
    written(here / "elsewhere", "my_slower", delay_ns=9)
    written(here / "study", "my_slower", delay_ns=7)
    assert delay_ns(load("../study/case.yaml").scenario) == 7


def test_the_current_folder_is_the_next_one(here):
    written(here / "elsewhere", "my_slowest", delay_ns=9)
    (here / "study" / "case.yaml").write_text((here / "elsewhere" / "case.yaml").read_text())
    assert delay_ns(load("../study/case.yaml").scenario) == 9


def test_it_is_the_folder_of_the_file_that_names_it(here):
    written(here / "base", "my_based")
    (here / "study" / "case.yaml").write_text("extends: ../base/case.yaml\n")
    assert load("../study/case.yaml").scenario.stop.when == f"{here}/base/my_based:enough"


def test_a_name_may_lead_to_another_folder(here):
    written(here / "models", "my_far")
    data = {"name": "x", "network": {"media": {"lan": {"model": "../models/my_far:Slow"}}}}
    assert delay_ns(from_mapping(data).scenario) == 5


def test_a_package_beside_the_scenario(here):
    written(here / "study" / "my_package", "inside")
    inside = here / "study" / "my_package"
    (inside / "__init__.py").touch()
    (inside / "inside.py").write_text(
        (inside / "inside.py").read_text().replace("from inside_helper", "from .inside_helper"))
    (here / "study" / "case.yaml").write_text(
        "name: x\nnetwork: {media: {lan: {model: 'my_package.inside:Slow'}}}\n")
    assert model(load("../study/case.yaml").scenario).__module__ == "my_package.inside"


def test_another_process_finds_it_again(here):
    """As a campaign's workers get their scenarios: their Python does not know the folder."""
    written(here / "study", "my_pickled")
    pickled = pickle.dumps(load("../study/case.yaml"))
    child = subprocess.run([sys.executable, "-c", (
        "import pickle, sys; loaded = pickle.load(sys.stdin.buffer); "
        "print(type(loaded.scenario.network.media['lan'].params).__module__)")],
        input=pickled, capture_output=True, check=True, cwd=here)
    assert child.stdout.strip() == b"my_pickled"


def test_the_resolved_scenario_finds_it_again_and_no_id_depends_on_the_folder(here):
    written(here / "study", "my_again")
    scenario = load("../study/case.yaml").scenario
    text = resolved(scenario, here / "results")
    assert "model: ../study/my_again:Slow" in text and "when: ../study/my_again:enough" in text
    (here / "results").mkdir()
    (here / "results" / "scenario.resolved.yaml").write_text(text)
    assert load("../results/scenario.resolved.yaml").scenario == scenario
    written(here / "copy", "my_again")
    assert scenario_id(load("../study/case.yaml").scenario, {})(1) == scenario_id(
        scenario.model_copy(update={"stop": scenario.stop.model_copy(
            update={"when": f"{here}/copy/my_again:enough"})}), {})(1)


def test_two_modules_of_one_name_are_refused(here):
    written(here / "study", "my_twin")
    written(here / "copy", "my_twin")
    load("../study/case.yaml")
    with pytest.raises(InputError) as caught:
        load("../copy/case.yaml")
    twin = (f"another module 'my_twin' is in use already, from {here}/study/my_twin.py; rename one "
            "of them")
    assert list(caught.value.args) == [
        f"../copy/case.yaml:2:32: network.media.lan.model: cannot load network 'my_twin:Slow': "
        f"{twin}",
        f"../copy/case.yaml:3:14: stop.when: cannot load function 'my_twin:enough': {twin}"]


PARTS = """
    from pydantic import Field
    from desim import ports
    from desim.units import Position

    class Right:
        class Params(ports.Params):
            at_m: Position = "0 m"
        reasons = ("said",)
        def __init__(self, params, more=None): pass
        def start(self, context, hosts): pass
        def judge(self, *everything): pass
        def send(self, frame): pass
        def choose(self, view): pass

    class Wrong(Right):
        {wrong}
"""
START = "        def start(self, context, hosts): pass\n"  # which no strategy has
WRONG = [  # kind of plug-in, what is wrong with its class, what is said
    ("rule", "def judge(self, frame): pass",
     "must take (self, frame, receivers) in judge, not (self, frame)"),
    ("rule", "def judge(frame, receivers): pass",
     "must take (self, frame, receivers) in judge, not (frame, receivers)"),
    ("rule", "def judge(self, frame: object, *, receivers: tuple = ()) -> None: pass",
     "must take (self, frame, receivers) in judge, not (self, frame, *, receivers=())"),
    ("rule", "def start(self, context): pass",
     "must take (self, context, hosts) in start, not (self, context)"),
    ("rule", "def __init__(self): pass", "must take (params) in __init__, not ()"),
    ("network", "def send(self, frame, receivers): pass",
     "must take (self, frame) in send, not (self, frame, receivers)"),
    ("network", "def build(self, params): pass",
     "must take (params) in build, not (self, params)"),
    ("strategy", "def choose(self, view, robot): pass",
     "must take (self, context) in choose, not (self, view, robot)"),
    ("rule", "reasons = 'said'",
     "must declare reasons = ('...',), a tuple of names, not 'said'"),
    ("network", "reasons = None\n        def send(self): pass",
     "must take (self, frame) in send, not (self), and declare reasons = ('...',), a tuple of "
     "names, not None"),
    ("strategy", "reads_team_state = True",
     "must declare traits = StrategyTraits(reads_team_state=...), not reads_team_state = ..., "
     "which nobody reads"),
    ("strategy", "needs = Right", "must declare traits = StrategyTraits(needs=...), not needs = "
     "..., which nobody reads"),
    ("strategy", "read_team_state = True", "must have no attribute read_team_state, which nobody "
     "reads (did you mean 'reads_team_state'?)"),
    ("strategy", "trait = ports.StrategyTraits(needs_coordinator=True)",
     "must have no attribute trait, which nobody reads (did you mean 'traits'?)"),
    ("strategy", "traits = {'needs_coordinator': True}",
     "must declare traits = StrategyTraits(...), not {'needs_coordinator': True}"),
    ("rule", "class Params(ports.Params):\n            at_m: Position = 0.0",
     "must correct the default of at_m, 0.0: 0.0 has no unit; allowed: m, km, cm, mm, e.g. "
     "'-38 m'"),
    ("rule", "class Params(ports.Params):\n            times: int = Field('three', ge=0)",
     "must correct the default of times, 'three': Input should be a valid integer"),
]


@pytest.mark.parametrize("number", range(len(WRONG)))
def test_a_class_that_breaks_its_contract_is_refused_where_it_is_named(here, number):
    kind, wrong, says = WRONG[number]
    parts = PARTS.replace(START, "") if kind == "strategy" else PARTS
    (here / "elsewhere" / f"part_{number}.py").write_text(
        textwrap.dedent(parts.format(wrong=wrong)))
    choice = {"rule": "network: {media: {lan: {model: ideal, rules: [{rule: 'NAME'}]}}}",
              "network": "network: {media: {lan: {model: 'NAME'}}}",
              "strategy": "coordination: {strategy: 'NAME'}"}[kind]
    path = {"rule": "network.media.lan.rules.0.rule", "network": "network.media.lan.model",
            "strategy": "coordination.strategy"}[kind]
    case = here / "elsewhere" / "case.yaml"
    case.write_text(f"name: x\n{choice.replace('NAME', f'part_{number}:Right')}\n")
    load(case)
    case.write_text(f"name: x\n{choice.replace('NAME', f'part_{number}:Wrong')}\n")
    with pytest.raises(InputError) as caught:
        load(case)
    column = choice.index("'NAME'") + 1
    assert str(caught.value) == (
        f"{case}:2:{column}: {path}: the {kind} 'part_{number}:Wrong' {says}")


def test_a_static_method_takes_no_self():
    class Static(ImmediateNetwork):
        def __init__(self, params):
            """There is nothing to set."""

        @staticmethod
        def send(frame):
            return 0

    assert plugins.misfit("network", Static) == ""


def test_a_dot_in_place_of_the_colon_is_guessed():
    with pytest.raises(InputError, match=r"^unknown strategy 'left.Far' \(did you mean "
                                         r"'left:Far'\?\); known: "):
        plugins.load("strategy", "left.Far")


def test_a_module_that_exits_does_not_end_desim(tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(tmp_path)
    (tmp_path / "exits_at_once.py").write_text("import sys\nsys.exit(0)\n")
    with pytest.raises(InputError) as caught:
        plugins.load("strategy", "exits_at_once:Any")
    assert str(caught.value) == "cannot load strategy 'exits_at_once:Any': SystemExit(0)"


@pytest.mark.parametrize("declared, says", [
    ("needs_coordinater=True", "StrategyTraits has no 'needs_coordinater' (did you mean "
     "'needs_coordinator'?); known: reads_team_state, needs_coordinator, needs"),
    ("needs_coordinator=1", "needs_coordinator of StrategyTraits is a bool, not 1")])
def test_a_wrong_trait_names_its_line(tmp_path, declared, says):
    (tmp_path / "declares.py").write_text(
        f"from desim import ports\nTRAITS = ports.StrategyTraits({declared})\n")
    with pytest.raises(InputError) as caught:
        plugins.load("strategy", f"{tmp_path}/declares:Any")
    assert str(caught.value) == f"cannot load strategy 'declares:Any': {says} at declares.py:2"


def test_a_module_that_fails_names_its_line(tmp_path):
    (tmp_path / "lacks.py").write_text("import os\nimport no_such_module\n")
    with pytest.raises(InputError) as caught:
        plugins.load("strategy", f"{tmp_path}/lacks:Any")
    assert str(caught.value) == ("cannot load strategy 'lacks:Any': No module named "
                                 "'no_such_module' at lacks.py:2")


OURS = [(kind, name) for kind in plugins.GROUPS for name, point in plugins.available(kind).items()
        if point.module.partition(".")[0] in ("desim", "netmodels") and kind != "validation"]


@pytest.mark.parametrize(("kind", "name"), OURS)
def test_descriptions_have_the_words_of_scenarios(kind, name):
    """And no names of constants, or of parameters with a unit, which stand in the code alone."""
    text = plugins.load(kind, name).__doc__ or ""
    assert not re.findall(r"``(?:[a-z_]+_(?:ns|hz|bps|mps|m|rad)|[A-Z]+_[A-Z_]+)``", text)
