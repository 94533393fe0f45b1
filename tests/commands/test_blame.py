"""Plug-ins that go wrong.

One line names the plug-in, its line, the host and the time; no traceback through desim, exit
code 1.
"""

import re
import sys
import textwrap

import pytest
from typer.testing import CliRunner

from desim import plugins
from desim.blame import blame, cause_of
from desim.cli import app

HEAD = """
    from desim import ports

    class Plugin:
        class Params(ports.Params):
            '''None.'''
        reasons = ("said",)
        def __init__(self, params): pass
        def start(self, context, hosts): self.context = context
"""
STRATEGY = HEAD.replace("def start(self, context, hosts): self.context = context", "") + """
        def choose(self, view):
            {body}
"""
METHODS = STRATEGY.replace("{body}", "return next(iter(view.frontiers(limit=1)), None)") + """\
        {body}
"""
TASK = HEAD.replace("context, hosts", "context").replace("reasons", "leads") + """
        def metrics(self): return {{'said': 1}}
        {body}
"""
LOCALIZATION = HEAD.replace("context, hosts", "context") + """
        def on_odometry(self, context, odometry, scan):
            {body}
"""
EACH_SECOND = "def start(self, context): context.every(10**9, self.tick)\n        "
NETWORK = HEAD + """
        def send(self, frame):
            {body}
"""
RULE = HEAD + """
        def judge(self, frame, receivers):
            {body}
"""
FUNCTION = """
    def Plugin(frame, receivers, context):
        {body}
"""
COMPUTERS = """
    from desim.computers.costs.ideal import IdealComputers

    class Plugin(IdealComputers):
        {body}
"""
MEMORY = "def system_bytes(self): return {}\n        def process_bytes(self, kept): return {}"
SCENARIO = """
name: bad
environment: {terrain: loop}
fleet: {size: 2}
stop: {elapsed: 20 s}
"""
MIDDLEWARE = HEAD.replace("context, hosts", "context") + """
        def switched(self, host, up): pass
        def advertise(self, offer): pass
        def subscribe(self, subscriber): pass
        {body}
"""
QUANTITIES = ("from desim.ports.tasks import TaskTraits\n"
              "        traits = TaskTraits(quantities=('{}',))\n        ")
ON_START = "def on_start(self, view): "
PLACES = {MIDDLEWARE: "middleware: {model: 'NAME:Plugin'}",
          COMPUTERS: "computers: 'NAME:Plugin'",
          TASK: "task: 'NAME:Plugin'",
          LOCALIZATION: "robot: {localization: 'NAME:Plugin'}",
          METHODS: "coordination: {strategy: 'NAME:Plugin'}",
          STRATEGY: "coordination: {strategy: 'NAME:Plugin'}",
          NETWORK: "network: {media: {lan: {model: 'NAME:Plugin'}}}",
          FUNCTION: "network: {media: {lan: {model: ideal, rules: [{rule: 'NAME:Plugin'}]}}}",
          RULE: "network: {media: {lan: {model: ideal, rules: [{rule: 'NAME:Plugin'}]}}}"}


@pytest.fixture
def desim(tmp_path, monkeypatch):
    """Runs a scenario with a plug-in whose method has this body, and returns what is printed."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", list(sys.path))

    def run(name, template, body, *options, loud=False):
        (tmp_path / f"{name}.py").write_text(textwrap.dedent(template.format(body=body)))
        (tmp_path / "bad.yaml").write_text(SCENARIO + PLACES[template].replace("NAME", name))
        arguments = ["run", "bad.yaml", *options, *([] if loud else ["--quiet"])]
        monkeypatch.setattr(sys, "argv", ["desim", *arguments])
        done = CliRunner().invoke(app, arguments)
        return done.exit_code, done.output

    return run


@pytest.mark.parametrize("name, template, body, says", [
    ("f_raises", FUNCTION, "return 1 / 0", "rule f_raises:Plugin raised ZeroDivisionError: "
     "division by zero at f_raises.py:3 (medium lan, "),
    ("s_raises", STRATEGY, "return 1 / 0", "strategy s_raises:Plugin raised ZeroDivisionError: "
     "division by zero at s_raises.py:12 (robot_"),
    ("l_raises", LOCALIZATION, "return 1 / 0", "localization l_raises:Plugin raised "
     "ZeroDivisionError: division by zero at l_raises.py:12 (robot_"),
    ("l_nan", LOCALIZATION, "return ports.Pose2D(float('nan'), 0.0, 0.0)", "l_nan.Plugin "
     "(l_nan.py:4) returned Pose2D(x_m=nan, y_m=0.0, yaw_rad=0.0) in on_odometry; wanted: a Pose2D "
     "of three finite numbers (robot_"),
    ("l_text", LOCALIZATION, "return 'here'", "l_text.Plugin (l_text.py:4) returned 'here' in "
     "on_odometry; wanted: a Pose2D of three finite numbers (robot_"),
    ("l_draws", LOCALIZATION, "context.draw(scan, odometry)", "localization l_draws:Plugin "
     "draws a scan; wanted: traits = LocalizationTraits(draws_map=True) in its class at "
     "l_draws.py:12 (robot_"),
    ("l_writes", LOCALIZATION, "scan and scan.ranges.fill(0.0); return odometry", "localization "
     "l_writes:Plugin writes into what it may only read, as scans are (ValueError: assignment "
     "destination is read-only); wanted: a copy at l_writes.py:12 (robot_"),
    ("l_timer", LOCALIZATION, "context.every(10**9, self.tick); return odometry\n"
     "        def tick(self, context): return 1 / 0", "localization l_timer:Plugin raised "
     "ZeroDivisionError: division by zero at l_timer.py:13 (robot_"),
    ("s_wall", STRATEGY, "return ports.Frontier(900.0, 0.0, 1.0, 9)",
     "s_wall.Plugin (s_wall.py:4) chose Frontier(x_m=900.0, y_m=0.0, path_m=1.0, cells=9); wanted: "
     "one of frontiers(), a Place on the robot's map, or None (robot_"),
    ("s_nan", STRATEGY, "return ports.Frontier(float('nan'), 0.0, 1.0, 9)",
     "s_nan.Plugin (s_nan.py:4) chose Frontier(x_m=nan, "),
    ("s_block", STRATEGY, "return ports.Frontier(0.0, 0.0, 1.0, 9)",
     "s_block.Plugin (s_block.py:4) chose Frontier(x_m=0.0, "),
    ("s_text", STRATEGY, "return 'left'", "s_text.Plugin (s_text.py:4) chose 'left'; wanted: one "),
    ("s_silent", STRATEGY, "view.publish('bid', 1)", "strategy s_silent:Plugin raised ModelError: "
     "topic 'bid' is published but not advertised; advertised: nothing at s_silent.py:12 (robot_"),
    ("s_json", STRATEGY, "view.advertise('bid'); view.publish('bid', {1, 2})", "strategy "
     "s_json:Plugin raised ModelError: JSON cannot hold {1, 2} (TypeError: Object of type set is "
     "not JSON serializable); publish numbers, texts, lists and mappings of them, or give "
     "size_bytes at s_json.py:12 (robot_"),
    ("s_size", STRATEGY, "view.advertise('bid'); view.publish('bid', 1, -1)", "strategy "
     "s_size:Plugin raised ModelError: size_bytes is an int >= 0, not -1 at s_size.py:12 (robot_"),
    ("s_gone", STRATEGY, "view.go('left')", "strategy s_gone:Plugin raised ModelError: "
     "a robot drives to a place of two finite numbers, not to 'left' at s_gone.py:12 (robot_"),
    ("s_timer", STRATEGY, "view.every(0, print)", "strategy s_timer:Plugin raised ModelError: "
     "a timer's period is an int >= 1000000 of ns (1 ms), not 0 at s_timer.py:12 (robot_"),
    ("s_late", STRATEGY, "view.after(10**9, lambda view: view.nothing)", "strategy s_late:Plugin "
     "raised AttributeError: 'HostContext' object has no attribute 'nothing' at s_late.py:12 "
     "(robot_"),
    ("s_typo", STRATEGY, "view.frontier()", "strategy s_typo:Plugin raised AttributeError: "
     "'HostContext' object has no attribute 'frontier' (did you mean 'frontiers'?) at s_typo.py:12 "
     "(robot_"),
    *((f"c_{name}", METHODS, f"def {form}: return 1 / 0", f"strategy c_{name}:Plugin raised "
       f"ZeroDivisionError: division by zero at c_{name}.py:13 (robot_") for name, form in (
           ("start", "on_start(self, view)"), ("map", "on_map(self, view)"),
           ("goal", "on_goal(self, view, place, end)"),
           ("mate", "on_teammate(self, view, name, heard)"))),
    ("c_message", METHODS, ON_START + "view.advertise('a'); view.subscribe('a', self.hear); "
     "view.every(10**9, lambda view: view.publish('a', 1))\n"
     "        def hear(self, view, message): return 1 / 0", "strategy c_message:Plugin raised "
     "ZeroDivisionError: division by zero at c_message.py:14 (robot_"),
    ("c_timer", METHODS, ON_START + "view.every(10**9, self.tick)\n"
     "        def tick(self, view): return 1 / 0", "strategy c_timer:Plugin raised "
     "ZeroDivisionError: division by zero at c_timer.py:14 (robot_"),
    ("c_loop", METHODS, ON_START + "view.after(0, self.on_start)", "strategy c_loop:Plugin raised "
     "KernelError: more than 1000 rounds at 0 ns: the loop goes through Node._run in phase CONTROL "
     "at c_loop.py:13 (robot_"),
    *((f"c_{name}", METHODS, ON_START + call, f"strategy c_{name}:Plugin raised ModelError: "
       f"{says} at c_{name}.py:13 (robot_0, 0 s)") for name, call, says in (
           ("soon", "view.every(999_999, print)",
            "a timer's period is an int >= 1000000 of ns (1 ms), not 999999"),
           ("past", "view.after(-1, print)",
            "a timer's delay is an int >= 0 of ns, not -1"),
           ("half", "view.after(0.5, print)",
            "a timer's delay is an int >= 0 of ns, not 0.5"),
           ("none", "view.after(5, None)", "a callback is a function of (context), not None"),
           ("args", "view.subscribe('a', self.choose)", "a callback takes (context, message); "
            "Plugin.choose takes (view)"),
           ("deaf", "view.subscribe('a', 5)",
            "a callback is a function of (context, message), not 5"),
           ("name", "view.advertise('a b')",
            "a topic is called as ROS names are, 'bid' or 'bid/best', not 'a b'"),
           ("queue", "view.advertise('a', queue=-1)",
            "a queue is an int >= 0 of messages (0: no bound), not -1"),
           ("pickle", "view.advertise('a'); view.publish('a', print.__self__, 10)",
            "<module 'builtins' (built-in)> cannot be pickled (TypeError: cannot pickle 'module' "
            "object)"),
           ("nan", "view.advertise('a'); view.publish('a', 1, float('nan'))",
            "size_bytes is an int >= 0, not nan"))),
    ("c_storm", METHODS, ON_START + "view.advertise('a'); view.subscribe('a', self.hear); "
     "view.after(10**9, lambda view: view.publish('a', 0))\n        def hear(self, view, message): "
     "view.publish('a', 1); view.publish('a', 2)", "strategy c_storm:Plugin raised ModelError: "
     "messages of one instant do not end (topic 'a'): do strategies answer each message with "
     "another one? at c_storm.py:14 (robot_"),
    ("c_timers", METHODS, ON_START + "[view.after(10**6, self.on_start) for _ in range(2)]",
     "strategy c_timers:Plugin raised ModelError: 10000 timers of this strategy wait on this host: "
     "do they set more than one new timer each? at c_timers.py:13 (robot_0, 0.013 s)"),
    ("c_away", METHODS, "def on_map(self, view): view.go((float('inf'), 0.0))", "strategy "
     "c_away:Plugin raised ModelError: a robot drives to a place of two finite numbers, not to "
     "(inf, 0.0) at c_away.py:13 (robot_"),
    ("c_peers", METHODS, "def on_map(self, view): view.peers['x'] = 5", "strategy c_peers:Plugin "
     "raised TypeError: 'mappingproxy' object does not support item assignment at c_peers.py:13 "),
    *((f"t_{name}", TASK, EACH_SECOND + f"def tick(self, context): {call}",
       f"task t_{name}:Plugin raised {says} at t_{name}.py:13 (1 s)") for name, call, says in (
           ("raises", "return 1 / 0", "ZeroDivisionError: division by zero"),
           ("reason", "context.end(5)", "ModelError: a run ends for a reason, a text, not 5"),
           ("who", "context.record('x', 'nobody')",
            "ModelError: a task's row is about a robot, or None, not 'nobody'"),
           ("row", "context.record('x', 'robot_0', 0.5)",
            "ModelError: a task's row has ints, not 0.5 and 0"))),
    ("t_args", TASK, EACH_SECOND + "def tick(self): pass", "task t_args:Plugin raised ModelError: "
     "a callback takes (context); Plugin.tick takes () at t_args.py:12"),
    ("s_list", STRATEGY, "return view.frontiers()[:1] * 99", "s_list.Plugin (s_list.py:4) chose a "
     "list of 99; wanted: one of frontiers(), a "),
    ("s_tuple", STRATEGY, "return tuple(view.frontiers()[0])",
     "s_tuple.Plugin (s_tuple.py:4) chose ("),
    ("s_words", STRATEGY, "return ports.Frontier('here', 0.0, 1.0, 9)",
     "s_words.Plugin (s_words.py:4) chose Frontier(x_m='here', "),
    *((f"n_{name}", NETWORK, f"return {value}", f"n_{name}.Plugin (n_{name}.py:4) delivers after "
       f"{shown}; wanted: an int >= 0 of nanoseconds (medium lan, ") for name, value, shown in (
           ("true", "True", "True"), ("float", "1000.0", "1000.0"), ("soon", "'soon'", "'soon'"),
           ("nan", "float('nan')", "nan"), ("before", "-1", "-1"))),
    ("r_yields", RULE, "yield ports.PASS", "r_yields.Plugin (r_yields.py:4) gave <generator "),
    ("r_true", RULE, "return True", "r_true.Plugin (r_true.py:4) gave True; wanted: None, or a "
     "list of one verdict for each receiver (medium lan, "),
    ("n_raises", NETWORK, "return {}['x']", "network n_raises:Plugin raised KeyError: 'x' at "
     "n_raises.py:12 (medium lan, "),
    ("n_past", NETWORK, "self.context.settle(frame, frame.receivers[0], ports.Deliver(-5))",
     "network n_past:Plugin raised "),
    ("n_late", NETWORK, "self.context.at(-1, print)", "network n_late:Plugin raised KernelError: "
     "time_ns must be an int >= now (0), got -1 for print at n_late.py:12 (medium lan, 0 s)"),
    ("n_callback", NETWORK, "self.context.at(self.context.now_ns + 7, self.start, frame)",
     "network n_callback:Plugin raised TypeError: Plugin.start() missing 1 required positional "
     "argument: 'hosts' at n_callback.py:9 (7e-09 s)"),
    ("r_bare", RULE, "return [ports.Drop('')] * len(receivers)", "r_bare.Plugin (r_bare.py:4) "
     "dropped without a reason; write Drop('...') with one of its reasons = ('said',) (medium "),
    ("n_reason", NETWORK, "self.context.settle(frame, frame.receivers[0], ports.Drop('other'))",
     "network n_reason:Plugin dropped for 'other', which its class does not declare (reasons = "
     "('said',)) at n_reason.py:12 (medium lan, "),
    ("n_stranger", NETWORK, "self.context.settle(frame, 99, ports.Drop('said'))",
     "network n_stranger:Plugin of medium 'lan' settled Frame(id=1, "),
    ("n_drop", NETWORK, "return ports.Drop('said')", "n_drop.Plugin (n_drop.py:4) returned "
     "Drop(reason='said', packets=None) from send; wanted: a delay in ns, or None and a call of "
     "context.settle(frame, receiver, verdict) (medium lan, "),
    ("r_raises", RULE, "raise RuntimeError", "rule r_raises:Plugin raised RuntimeError at "
     "r_raises.py:12 (medium lan, "),
    ("r_text", RULE, "return ['no'] * len(receivers)", "r_text.Plugin (r_text.py:4) gave 'no', "
     "which is no verdict; wanted: PASS, Drop, Deliver or Duplicate (medium lan, "),
    *((f"r_one_{name}", RULE, f"return ports.{verdict}", f"r_one_{name}.Plugin (r_one_{name}.py:4) "
       f"gave the one verdict {shown}; wanted: None, or a list with one for each receiver (medium "
       "lan, ") for name, verdict, shown in (
           ("pass", "PASS", "Pass()"), ("late", "Deliver(5)", "Deliver(delay_ns=5)"),
           ("drop", "Drop('said')", "Drop(reason='said', packets=None)"))),
    ("k_raises", COMPUTERS, "def callback_ns(self, work): return 1 // (work.node != 'move_base')",
     "computers k_raises:Plugin raised ZeroDivisionError: integer division or modulo by zero at "
     "k_raises.py:5 (robot_"),
    ("k_sends", COMPUTERS, "def send_ns(self, topic, size_bytes, links): return 1 / 0",
     "computers k_sends:Plugin raised ZeroDivisionError: division by zero at k_sends.py:5 (robot_"),
    ("k_hears", COMPUTERS, "def receive_ns(self, topic, size_bytes): return 1 / 0",
     "computers k_hears:Plugin raised ZeroDivisionError: division by zero at k_hears.py:5 (robot_"),
    ("k_before", COMPUTERS, "def callback_ns(self, work): return -7",
     "k_before.Plugin.callback_ns (k_before.py:5) answered -7 to Work(node='"),
    ("k_system", COMPUTERS, MEMORY.format("0.5", "0"), "k_system.Plugin.system_bytes "
     "(k_system.py:5) answered 0.5; wanted: an int >= 0, in bytes (robot_0, 0 s)"),
    ("k_process", COMPUTERS, MEMORY.format("0", "5.5"),
     "k_process.Plugin.process_bytes (k_process.py:6) answered 5.5 to Kept(node='"),
    ("k_memory", COMPUTERS, MEMORY.format("0", "1 / 0"), "computers k_memory:Plugin raised "
     "ZeroDivisionError: division by zero at k_memory.py:6 (robot_0, 0 s)"),
    ("r_nan", RULE, "return [ports.Deliver(float('nan'))] * len(receivers)",
     "r_nan.Plugin (r_nan.py:4) delays by nan; wanted: an int >= 0 of nanoseconds (medium lan, "),
])
def test_the_plug_in_is_named_with_its_line_host_and_time(desim, name, template, body, says):
    code, output = desim(name, template, body)
    assert code == 1
    assert output.startswith(says), output
    assert "Traceback" not in output
    assert output.endswith("this repeats it:\n  desim run bad.yaml --quiet\n")
    assert output.splitlines()[0].endswith(" s)")
    if template is COMPUTERS:
        assert re.search(r"\(robot_[01], [\d.e-]+ s\)$", output.splitlines()[0]), output


@pytest.mark.parametrize("name, body, says", [
    ("q_more", QUANTITIES.format("more") + "def measure(self): return {'less': 1}",
     "q_more.Plugin (q_more.py:4) measured {'less': 1}; wanted: its quantities, ('more',), with "
     "other names than those of every run"),
    ("q_taken", QUANTITIES.format("explored") + "def measure(self): return {'explored': 1}",
     "q_taken.Plugin (q_taken.py:4) measured {'explored': 1}; "),
    ("q_nan", "def metrics(self): return {'share': float('nan')}", "q_nan.Plugin (q_nan.py:4) has "
     "the metric share = nan; wanted: finite numbers, words, None, lists and mappings of them"),
    ("q_none", "def metrics(self): return None", "q_none.Plugin (q_none.py:4) has None as its "
     "metrics; wanted: values by names"),
    ("q_twice", "def metrics(self): return {'collisions': 1}", "q_twice.Plugin (q_twice.py:4) has "
     "metrics that every run has: collisions; choose other names"),
    ("q_judged", "def judged(self): return 'robot_1'", "q_judged.Plugin (q_judged.py:4) judged "
     "'robot_1'; wanted: a place among the 2 explorers, or None"),
])
def test_what_a_task_says_is_looked_at(desim, name, body, says):
    code, output = desim(name, TASK, body, "--set", "stop.elapsed=2 s")
    assert code == 1
    assert output.startswith(says), output
    assert "Traceback" not in output


STOP_FUNCTIONS = """
    import numpy as np
    def asks(quantities): return quantities["nonsense"] > 3
    def sums(quantities): return total([])
    def total(values): return max(values)
    def leaves(quantities): raise SystemExit(3)
    def gives(quantities): return np.array([1, 2])
    class Late:
        def __call__(self, quantities): return 1 / 0
    late = Late()
    def two(quantities, more): return True
    {body}
"""
PLACES[STOP_FUNCTIONS] = ""


@pytest.mark.parametrize("name, says", [
    ("asks", "asks raised KeyError: 'nonsense' at f_asks.py:3"),
    ("sums", "sums raised ValueError: max() arg is an empty sequence at f_sums.py:5"),
    ("leaves", "leaves raised SystemExit: 3 at f_leaves.py:6"),
    ("gives", "gives (f_gives.py:7) returned array([1, 2]); wanted: true or false"),
    ("late", "late raised ZeroDivisionError: division by zero at f_late.py:9")])
def test_a_function_to_stop_at_is_named_with_its_line_and_time(desim, name, says):
    option = f"stop.when=f_{name}:{name}"
    code, output = desim(f"f_{name}", STOP_FUNCTIONS, "", "--set", option)
    assert code == 1
    assert output.replace(f"f_{name}.{name}", f"f_{name}:{name}") == (
        f"stop.when: f_{name}:{says} (0 s)\nthis repeats it:\n  desim run bad.yaml --set {option} "
        "--quiet\n")
    _, output = desim(f"f_{name}", STOP_FUNCTIONS, "", "--set", option, "--traceback")
    assert "Traceback (most recent call last)" in output and "stop_function.py" in output


def test_a_function_to_stop_at_takes_the_quantities(desim):
    assert desim("f_two", STOP_FUNCTIONS, "", "--set", "stop.when=f_two:two") == (2, (
        "--set stop.when=f_two:two: stop.when: the function 'f_two:two' must take (quantities), "
        "not (quantities, more)\n"))


def test_a_callback_that_takes_other_arguments_is_refused_at_the_door(desim):
    assert desim("c_form", METHODS, "def on_goal(self, view): return 1") == (2, (
        "bad.yaml:6:26: coordination.strategy: the strategy 'c_form:Plugin' must take (self, "
        "context, place, end) in on_goal, not (self, view)\n"))


def test_a_network_that_settles_nothing_is_pointed_at(desim):
    """The run ends as if all were well; the twin that delivers everything is not warned of."""
    for name, body, warned in (("w_none", "pass", True), ("w_all", "return 0", False)):
        code, output = desim(name, NETWORK, body, "--until", "2 s", loud=True)
        assert code == 0
        assert ("frames are neither delivered nor dropped at the end: does its model settle every "
                "frame?" in output) == warned, output


def test_a_fleet_that_never_moves_is_pointed_at(desim):
    _, output = desim("w_still", STRATEGY, "return None", loud=True)
    assert ("warning: no robot has moved: does the strategy choose goals, and do commands arrive?"
            in output)


def test_the_traceback_is_there_for_who_wants_it(desim):
    _, output = desim("s_trace", STRATEGY, "return 1 / 0", "--traceback")
    assert "Traceback (most recent call last)" in output and "return 1 / 0" in output


def test_equal_causes_at_other_times_are_equal():
    line = "strategy a:B raised ZeroDivisionError: division by zero at a.py:7"
    assert cause_of(f"{line} (robot_3, 2.35 s)") == line == cause_of(f"{line} (2.35 s)")
    assert cause_of("f(x, 2) is wrong") == "f(x, 2) is wrong"


@pytest.mark.parametrize("name, more, says", [
    ("b_nan", "def busy_ns(self, hosts): return [float('nan')] * len(hosts)",
     "b_nan.Plugin (b_nan.py:4) was busy for [nan, "),
    ("b_two", "def busy_ns(self, hosts): return [0] * 2 * len(hosts)",
     "b_two.Plugin (b_two.py:4) was busy on 6 channels, and has names of 3"),
    ("b_far", "reach_m = 'far'",
     "b_far.Plugin (b_far.py:4) has reach_m = 'far'; wanted: a number of metres >= 0"),
])
def test_what_a_network_offers_besides_is_looked_at(desim, name, more, says):
    code, output = desim(name, NETWORK, f"return 0\n\n        {more}")
    assert code == 1
    assert output.startswith(says), output
    assert "Traceback" not in output


@pytest.mark.parametrize("name, body, says", [
    ("m_numbers", "def subscribers(self, publisher): return [1, 2]",
     "m_numbers.Plugin (m_numbers.py:4) gave [1, 2] for the subscribers of "),
    ("m_nobody", "def subscribers(self, publisher): pass",
     "m_nobody.Plugin (m_nobody.py:4) gave None for the subscribers of "),
    ("m_transport", "def subscribers(self, publisher): return ()\n"
     "        def transport(self, offer): pass",
     "m_transport.Plugin (m_transport.py:4) gave the transport None for "),
])
def test_what_a_middleware_gives_is_looked_at(desim, name, body, says):
    code, output = desim(name, MIDDLEWARE, body)
    assert code == 1
    assert output.startswith(says), output
    assert "Traceback" not in output


def test_a_rule_function_is_described(tmp_path, monkeypatch):
    (tmp_path / "f_says.py").write_text("def storm(frame, receivers):\n    'A storm.'\n")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", list(sys.path))
    done = CliRunner().invoke(app, ["describe", "f_says:storm"])
    assert done.exit_code == 0
    assert done.output == ("f_says:storm (rule): f_says:storm\n\nA storm.\n\ndrops for: storm\n\n"
                           "parameters:\n  hosts: default [].  names or patterns with * and ?: "
                           "all that these send and receive\n  links: default [].  two of these "
                           "each: all between them, in both directions\n  topics: default [].  "
                           "names or patterns with * and ?, which stand for slashes, too; scan is "
                           "that of every host: all frames with data of these, no "
                           "acknowledgements, discovery or other control frames (none: all "
                           "frames)\n  from: default '0 ns'.  "
                           "(the beginning)\n  until: default None.  null: for good\n  every: "
                           "default None.  from one beginning to the next (null: it happens "
                           "once)\n")


def test_a_plug_in_installed_beside_desim_is_foreign(monkeypatch):
    class Neighbour:
        def choose(self, view):
            return 1 / view

    monkeypatch.setitem(plugins.LOADED, Neighbour, "strategy neighbour")
    with pytest.raises(ZeroDivisionError) as caught:
        Neighbour().choose(0)
    found = blame(caught.value)
    assert found.foreign
    assert found.line.startswith("strategy neighbour raised ZeroDivisionError: division by zero at "
                                 "test_blame.py:")


def test_a_plug_in_without_a_file_hides_no_error(monkeypatch):
    """As one that was written in a notebook, or whose module is gone."""
    monkeypatch.setitem(plugins.LOADED, type("Sketch", (), {"__module__": "gone"}), "rule sketch")
    with pytest.raises(RuntimeError) as caught:
        raise RuntimeError("no sun")
    assert blame(caught.value).line.startswith("RuntimeError: no sun at ")
