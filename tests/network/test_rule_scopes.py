"""One scope for all rules: hosts, links, topics and a time window, in front of any rule."""

from functools import cache

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from desim import plugins, ports
from desim.errors import InputError
from desim.network.scoped_rule import scoped
from desim.scenario.load import load
from desim.simulation.simulation import Simulation
from desim.testing import Bench, ImmediateNetwork
from netmodels.multihop import Multihop

MS = 10**6
LOSSY = {"probability": 0.5}


def ruled(name, **params):
    """The rule ``name`` as a scenario would have it."""
    cls = plugins.load("rule", name)
    found = plugins.parameters("rule", name)(**params)
    return scoped(cls(found), found)


def window(start, until, **more):
    return {"from": start, "until": until, **more}


def fates(rule, pairs, every_ms=10, frames=200):
    """The fates of frames over ``pairs`` in turn, by their numbers."""
    bench = Bench(ImmediateNetwork(), 4, rules=[rule])
    for number in range(frames):
        for source, receiver in pairs:
            bench.send(number * every_ms * MS, source, receiver, 1000, label=number)
    return {(source, receiver, label): (fate, time_ns - label * every_ms * MS)
            for time_ns, label, source, receiver, fate in bench.run()}


AB, BA, BC = ("host_1", "host_2"), ("host_2", "host_1"), ("host_2", "host_3")


RULES = {"loss": LOSSY, "residual_loss": LOSSY, "gilbert_elliott": {"p": 0.2, "r": 0.3},
         "duplication": LOSSY, "reordering": LOSSY | {"delay": "3 ms"},
         "latency": {"delay": "5 ms", "jitter": "2 ms"},
         "jamming": LOSSY | {"at": ["0 m", "0 m"], "radius": "5 m"}}


@cache
def everything(name):
    """The fates under a rule without a scope."""
    return fates(ruled(name, **RULES[name]), (AB, BA, BC))


@pytest.mark.parametrize("name", RULES)
@settings(max_examples=12)
@given(begin=st.integers(0, 100), length=st.integers(1, 100))
def test_within_its_scope_a_link_keeps_its_fates_and_out_of_it_all_passes(name, begin, length):
    times = window(f"{begin * 10} ms", f"{(begin + length) * 10} ms")
    found = fates(ruled(name, **RULES[name], **times, links=[["host_1", "host_2"]]), (AB, BA, BC))
    within = {key for key in found
              if key[:2] in (AB, BA) and begin <= key[2] < begin + length}
    assert {key: found[key] for key in within} == {key: everything(name)[key] for key in within}
    assert {found[key] for key in found.keys() - within} <= {("arrived", 0)}


def test_hosts_are_named_by_patterns_and_meant_in_both_directions():
    found = fates(ruled("latency", delay="5 ms", hosts=["*_1"]), (AB, BA, BC), frames=1)
    assert found == {(*AB, 0): ("arrived", 5 * MS), (*BA, 0): ("arrived", 5 * MS),
                     (*BC, 0): ("arrived", 0)}


def test_a_window_comes_again():
    found = fates(ruled("loss", probability=1.0, **window("10 ms", "20 ms", every="30 ms")), (AB,),
                  frames=6)
    assert [fate for fate, _ in found.values()] == [
        "arrived", "random_loss", "arrived", "arrived", "random_loss", "arrived"]


def test_a_token_bucket_does_not_count_what_is_out_of_its_scope():
    """Twelve frames of 1000 B fill a burst of 10 kB but for what other links and times had."""
    slow = {"rate": "1 kb/s", "burst": "10 kB", "links": [["host_2", "host_3"]]}
    found = fates(ruled("bandwidth", **slow, **window("50 ms", "1 s")), (BA, BC), every_ms=1,
                  frames=62)
    late = [key for key, (_, late_ns) in found.items() if late_ns]
    assert late == [(*BC, 60), (*BC, 61)]


def test_a_range_within_a_scope_separates_nobody_out_of_it():
    bench = Bench(ImmediateNetwork(), {"a": (0, 0), "b": (90, 0), "c": (0, 90)},
                  rules=[ruled("range", distance="50 m", links=[["a", "b"]])])
    bench.send(0, "a", ["b", "c"], 100, broadcast=True)
    assert {receiver: fate for *_, receiver, fate in bench.run()} == {
        "b": "out_of_range", "c": "arrived"}
    assert bench.medium.linked(bench.medium.attached) is None


def test_topics_leave_the_others_their_fates():
    """A host of ``Bench`` sends messages of one topic, ``frames``."""
    def lossy(*topics, **scope):
        return fates(ruled("loss", **LOSSY, topics=list(topics), **scope), (AB, BA, BC))

    everything, found = lossy("frames"), lossy("/nothing", "/*_1/frames")
    assert {key: found[key] for key in found if key[0] == "host_1"} == {
        key: everything[key] for key in found if key[0] == "host_1"}
    assert {found[key] for key in found if key[0] != "host_1"} == {("arrived", 0)}
    within = lossy("/host_2/frames", hosts=["host_3"], **window("0 s", "1 s"))
    assert {key for key, (fate, _) in within.items() if fate != "arrived"} == {
        key for key, (fate, _) in everything.items()
        if fate != "arrived" and key[:2] == BC and key[2] < 100}


@pytest.mark.parametrize("name, params", [
    ("outage", {"hosts": ["host_1"]}), ("partition", {"groups": [["host_1"]]})])
def test_what_keeps_off_some_topics_separates_nobody(name, params):
    bench = Bench(ImmediateNetwork(), 3, rules=[ruled(name, **params, topics=["/host_2/*"])])
    for source, receiver in AB, BA:
        bench.send(0, source, receiver, 100)
    assert {source: fate for *_, source, _, fate in bench.run()} == {
        "host_1": "arrived", "host_2": bench.medium.rules[0].reasons[0]}
    assert bench.medium.linked(bench.medium.attached) is None
    assert not hasattr(bench.medium.rules[0], "carrier")


@pytest.mark.parametrize("routing", ["static", "batman"])
def test_each_hop_carries_the_topics_of_its_frame(routing):
    """The hop from b to c loses what a sends, and neither what b sends nor what batman does."""
    def sent(*rules):
        bench = Bench(Multihop(Multihop.Params(hop="radio", routing=routing)),
                      {"a": (0.0, 0.0), "b": (30.0, 0.0), "c": (60.0, 0.0)}, rules=rules)
        for source, receiver in ("a", "c"), ("b", "c"), ("c", "a"):
            bench.send(30 * 10**9, source, receiver, 100)
        return sorted((source, fate) for *_, source, _, fate in bench.run(40 * 10**9))

    lossy = ruled("loss", probability=1.0, topics=["/a/*"], links=[["b", "c"]])
    assert sent() == [("a", "arrived"), ("b", "arrived"), ("c", "arrived")]
    assert sent(lossy) == [("a", "retry_limit"), ("b", "arrived"), ("c", "arrived")]


def test_a_rule_without_a_scope_is_the_rule_itself():
    assert type(ruled("loss", probability=0.5)) is plugins.load("rule", "loss")


def test_a_plug_in_s_own_keys_are_its_own():
    class Own(ports.Params):
        hosts: int

    assert ports.scope_beside(Own) == [ports.TimeWindow, ports.Topics]
    assert ports.with_scope(Own)(hosts=3).hosts == 3


def test_a_partition_within_links():
    rule = ruled("partition", groups=[["host_2"]], links=[["host_1", "host_2"]])
    assert {key[:2]: fate for key, (fate, _) in fates(rule, (AB, BC), frames=1).items()} == {
        AB: "partitioned", BC: "arrived"}


SCENARIO = """
name: scopes
fleet: {size: 2}
hosts: {base: {at: [0 m, 0 m]}}
network:
  media:
    lan:
      model: ideal
      rules:
"""


@pytest.mark.parametrize(("rule", "says"), [
    ("{rule: loss, probability: 30 %, links: [[robt_0, base]]}",
     "network.media.lan.rules.0.links.0.0: 'robt_0' names no host (did you mean 'robot_0'?); "
     "hosts are base, robot_0, robot_1, workstation"),
    ("{rule: range, hosts: [nobody]}",
     "network.media.lan.rules.0.hosts.0: 'nobody' names no host; hosts are base, robot_0, "
     "robot_1, workstation"),
    ("{rule: latency, delay: 1 s, from: 90 s, until: 60 s}",
     "9:11: network.media.lan.rules.0: until must be later than from, got 90 s to 60 s"),
    ("{rule: duplication, probability: 1 %, link: [[base, robot_0]]}",
     "9:49: network.media.lan.rules.0.link: unknown key (did you mean 'links'?); allowed: "
     "rule, probability, after, hosts, links, topics, from, until, "
     "every")])
def test_wrong_scopes(tmp_path, rule, says):
    path = tmp_path / "s.yaml"
    path.write_text(f"{SCENARIO[1:]}        - {rule}\n")
    with pytest.raises(InputError) as caught:
        Simulation(load(str(path)).scenario)
    assert str(caught.value).replace(f"{path}:", "") == says


def test_what_users_wished(tmp_path):
    path = tmp_path / "s.yaml"
    path.write_text(f"""{SCENARIO[1:]}\
        - {{rule: loss, probability: 30 %, from: 60 s, until: 90 s, links: [[robot_0, base]]}}
        - {{rule: latency, delay: 200 ms, from: 60 s, until: 90 s}}
""")
    loss, latency = load(str(path)).scenario.network.media["lan"].rules
    assert loss.params.links == [("robot_0", "base")]
    assert (latency.params.start_ns, latency.params.until_ns) == (60 * 10**9, 90 * 10**9)
