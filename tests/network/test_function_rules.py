"""A plain function is a rule."""

import re
import sys

import pytest

from desim import plugins, ports
from desim.errors import InputError, ModelError
from desim.scenario.load import load
from desim.simulation.simulation import Simulation
from desim.testing import Bench, ImmediateNetwork, check_rule
from desim.units import NS_PER_S

HERE = r"test_function_rules\.py:\d+"
STORM = """
from desim.ports import Drop

def storm(frame, receivers, context):
    if 5 * 10**9 <= context.now_ns < 15 * 10**9:
        return Drop()
"""


def storm(frame, receivers):
    return ports.Drop()


def slow_first(frame, receivers):
    return [ports.Deliver(7)] + [ports.PASS] * (len(receivers) - 1)


def after_a_second(frame, receivers, context):
    return ports.Drop() if context.now_ns >= NS_PER_S else None


def fates(function, times_ns=(0,), receivers=("host_2", "host_3")):
    bench = Bench(ImmediateNetwork(), 3, rules=[function])
    for time_ns in times_ns:
        bench.send(time_ns, "host_1", list(receivers), 100, broadcast=True)
    return [(time_ns, receiver, fate) for time_ns, *_, receiver, fate in bench.run()]


def test_a_verdict_is_for_all_receivers_and_a_drop_carries_the_function_s_name():
    assert fates(storm) == [(0, "host_2", "storm"), (0, "host_3", "storm")]


def test_a_list_has_a_verdict_for_each_receiver():
    assert fates(slow_first) == [(0, "host_3", "arrived"), (7, "host_2", "arrived")]


def test_it_may_ask_for_the_context_and_let_frames_pass():
    assert fates(after_a_second, (0, NS_PER_S), ["host_2"]) == [
        (0, "host_2", "arrived"), (NS_PER_S, "host_2", "after_a_second")]


def test_a_default_is_its_own():
    def choosy(frame, receivers, most=1):
        return ports.Drop() if len(receivers) > most else None

    assert fates(choosy) == [(0, "host_2", "choosy"), (0, "host_3", "choosy")]


def test_it_may_drop_packets_of_a_train():
    def nibble(frame, receivers):
        return ports.Drop(packets=(0,))

    bench = Bench(ImmediateNetwork(), 2, rules=[nibble])
    bench.send(0, "host_1", "host_2", 3000, segments=2, label="train")
    assert [fate for *_, fate in bench.run()] == ["arrived in part"]
    assert bench.parts == [("train", "host_2", {0: "nibble"})]


@pytest.mark.parametrize("function", [storm, slow_first, after_a_second])
def test_it_passes_the_conformance_kit(function):
    check_rule(function)


def named_otherwise(frame, receivers):
    return ports.Drop("rain")


def no_verdict(frame, receivers):
    return [True]


def too_few(frame, receivers):
    return []


@pytest.mark.parametrize("function, says", [
    (named_otherwise, rf"\.named_otherwise \({HERE}\) dropped for 'rain'; the drops of a function "
                      r"carry its name, 'named_otherwise': write Drop\(\)$"),
    (no_verdict, rf"\.no_verdict \({HERE}\) gave True, which is no verdict; wanted: "
                 "PASS, Drop, Deliver or Duplicate$"),
    (too_few, rf"\.too_few \({HERE}\) gave 0 verdicts for 1 receivers$"),
    (lambda frame, receivers: 1, rf"<lambda> \({HERE}\) gave 1; wanted: None, or a list of one "
                                 "verdict for each receiver$")])
def test_a_bad_answer_names_the_function(function, says):
    with pytest.raises(ModelError) as error:
        fates(function, receivers=["host_2"])
    assert re.search(says, str(error.value)), error.value


def test_a_function_with_other_arguments_is_refused():
    def weather(frame):
        return None

    with pytest.raises(InputError, match=rf"weather \({HERE}\) takes \(frame\); a function that is "
                                         r"a rule takes \(frame, receivers\) or \(frame, "
                                         r"receivers, context\)$"):
        ports.function_rule(weather)


@pytest.fixture
def scenario(tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(tmp_path)

    made = []

    def write(rule, code=STORM, module="gales"):
        made.append(module)
        (tmp_path / f"{module}.py").write_text(code)
        path = tmp_path / "case.yaml"
        path.write_text("name: case\nfleet: {size: 2}\nnetwork: {media: {lan: {model: ideal, "
                        f"rules: [{rule}]}}}}}}\nstop: {{elapsed: 20 s}}\n")
        return load(path).scenario

    yield write
    plugins.load.cache_clear()
    for module in made:
        sys.modules.pop(module, None)


def test_a_scenario_names_it_by_its_dotted_path(scenario):
    simulation = Simulation(scenario("{rule: 'gales:storm'}"))
    simulation.run()
    (lan,) = simulation.graph.media
    assert lan.dropped["storm"] > 0 and lan.delivered > 0
    cls = plugins.load("rule", "gales:storm")
    assert plugins.reference("rule", "gales:storm", cls) == "gales:storm"


@pytest.mark.parametrize("rule, code, module, says", [
    ("{rule: 'gale:storm', speed: 3}", STORM, "gale",
     "network.media.lan.rules.0.speed: unknown key"),
    ("{rule: 'calm:storm'}", "def storm(frame):\n    pass\n", "calm",
     "calm.storm (calm.py:1) takes (frame); a function that is a rule takes"),
    ("{rule: 'still:storm'}", "storm = 3\n", "still",
     "the rule 'still:storm' has no start(), judge(): it is not a plug-in")])
def test_a_scenario_with_a_bad_one_is_refused(scenario, rule, code, module, says):
    with pytest.raises(InputError) as error:
        scenario(rule, code, module)
    assert says in str(error.value)
