"""Loss, delay and rate of a link that were recorded are those of its frames, from row to row."""

import math

import numpy as np
import pytest

from desim import plugins
from desim.errors import InputError
from desim.scenario import load
from desim.testing import Bench, ImmediateNetwork, check_rule
from netmodels.rules.recorded import RecordedDelay, RecordedLoss, RecordedRate

MS, S = 10**6, 10**9
RULES = [RecordedLoss, RecordedDelay, RecordedRate]

# A walk away from the base station and back: whole, as somebody may have written it down.
WALK = """time_s,source,destination,loss_percent,delay_ms,rate_mbps
0,a,b,0,2,8
1,a,b,20,5.5,
2,a,b,100,,0
3,a,b,,30,0.8
1,b,a,0,1,
"""


@pytest.fixture
def file(tmp_path):
    def written(text):
        path = tmp_path / "walk.csv"
        path.write_text(text)
        return str(path)
    return written


def make(cls, path, **params):
    return cls(cls.Params(file=path, **params))


def log(rules, sends, **options):
    """(at ms, label, fate) of frames: (from s, link, bytes, packets)."""
    bench = Bench(ImmediateNetwork(), {"a": (0, 0), "b": (9, 0), "c": (1, 1)}, rules=rules,
                  **options)
    for label, (from_s, link, size_bytes, segments) in enumerate(sends):
        bench.send(round(from_s * S), *link, size_bytes, segments, label=label)
    return [(time_ns / MS, label, fate) for time_ns, label, *_, fate in bench.run()]


def test_the_delay_is_that_of_the_last_row_before_the_frame_was_sent(file):
    sends = [(at_s, link, 100, 1) for at_s in (0, 0.999999999, 1, 2.5, 3, 900)
             for link in ("ab", "ba", "ac")]
    found = log([make(RecordedDelay, file(WALK))], sends)
    late_ms = {label: time_ms - 1000 * round(sends[label][0], 9) for time_ms, label, _ in found}
    assert [[round(late_ms[3 * k + link], 3) for k in range(6)] for link in range(3)] == [
        [2, 2, 5.5, 5.5, 30, 30],  # an empty cell says nothing new
        [0, 0, 1, 1, 1, 1],
        [0] * 6]  # not in the file


def test_the_twin_a_delay_in_another_unit_shows(file):
    (found,) = log([make(RecordedDelay, file(WALK.replace("delay_ms", "delay_us")))],
                   [(0, "ab", 100, 1)])
    assert found == (0.002, 0, "arrived")


def test_the_begin_and_the_names_of_the_trace_are_the_scenarios(file):
    rule = make(RecordedDelay, file(WALK), begin="2.5 s", nodes={"a": "b", "b": "a"})
    assert log([rule], [(0, "ba", 100, 1), (0.5, "ba", 100, 1), (0, "ab", 100, 1)]) == [
        (1, 2, "arrived"), (5.5, 0, "arrived"), (530, 1, "arrived")]


def share(path, from_s, packets=3000):
    """Of so many packets within 0.1 s, those that arrive."""
    sends = [(from_s + 1e-5 * k, "ab", 100, 1) for k in range(packets)]
    return sum(fate == "arrived" for *_, fate in log([make(RecordedLoss, path)], sends)) / packets


def near(found, chance, packets=3000):
    return abs(found - chance) < 3.3 * math.sqrt(chance * (1 - chance) / packets)


def test_the_loss_is_that_of_the_time(file):
    path = file(WALK)
    assert [share(path, at_s, 100) for at_s in (0, 2, 3)] == [1, 0, 0]
    assert near(share(path, 1), 0.8)


def test_the_twin_a_fifth_more_loss_shows(file):
    assert not near(share(file(WALK.replace("a,b,20", "a,b,24")), 1), 0.8)


def test_of_a_train_the_packets_that_are_lost_are_counted(file):
    bench = Bench(ImmediateNetwork(), {"a": (0, 0), "b": (9, 0)},
                  rules=[make(RecordedLoss, file(WALK))])
    bench.send(S, "a", "b", 150_000, 100)
    assert [fate for *_, fate in bench.run()] == ["arrived in part"]
    assert bench.medium.packets_dropped == {"recorded_loss": 20}


def test_frames_of_a_link_wait_for_each_other_at_its_rate(file):
    """1000 bytes take 1 ms at 8 Mb/s, and 10 ms at 0.8 Mb/s. The other way is another queue."""
    rule = make(RecordedRate, file(WALK), backlog="2500 B")
    sends = [(0, "ab", 1000, 1), (0, "ab", 1000, 1), (0, "ab", 1000, 1), (0, "ba", 1000, 1),
             (1, "ab", 1000, 1), (2, "ab", 1000, 1), (3, "ab", 1000, 1), (3.015, "ab", 500, 1)]
    assert log([rule], sends) == [
        (0, 2, "rate_limited"), (0, 3, "arrived"), (1, 0, "arrived"), (2, 1, "arrived"),
        (1001, 4, "arrived"), (2000, 5, "rate_limited"), (3010, 6, "arrived"),
        (3020, 7, "arrived")]


def test_the_twin_a_tenth_less_rate_shows(file):
    with pytest.raises(AssertionError):
        test_frames_of_a_link_wait_for_each_other_at_its_rate(
            lambda text: file(text.replace(",8\n", ",7.2\n").replace(",0.8\n", ",0.72\n")))


def test_the_three_add_up_in_front_of_any_network(file):
    path = file(WALK)
    rules = [make(cls, path) for cls in RULES]
    assert log(rules, [(0, "ab", 1000, 1), (0, "ab", 1000, 1), (2.1, "ab", 1000, 1)]) == [
        (3, 0, "arrived"), (4, 1, "arrived"), (2100, 2, "recorded_loss")]


def test_what_takes_no_place_behind_the_rule_takes_none_in_it(file):
    rule = make(RecordedRate, file(WALK))
    bench = Bench(ImmediateNetwork(), {"a": (0, 0), "b": (9, 0)}, rules=[rule])
    bench.send(0, "a", "b", 1000, 1)
    bench.book(1, lambda _: rule.refused(0, 1000), None)
    bench.send(2, "a", "b", 1000, 1)
    assert [time_ns for time_ns, *_ in bench.run()] == [MS, MS + 2]


@pytest.mark.parametrize(("cls", "time_s"), [(RecordedLoss, 2), (RecordedRate, 2)])
def test_a_link_that_lets_nothing_through_is_parted(file, cls, time_s):
    bench = Bench(ImmediateNetwork(), {"a": (0, 0), "b": (9, 0)}, rules=[make(cls, file(WALK))])
    linked = []
    for at_s in (0, time_s):
        bench.book(at_s * S, lambda _: linked.append(
            bench.medium.linked(np.arange(2)).tolist()[0][1]), None)
    bench.run()
    assert linked == [True, False]


def test_a_survey_gives_the_values_of_a_place(file):
    path = file("x_m,y_m,node,delay_ms\n0,0,base,1\n50,0,base,7\n")
    bench = Bench(ImmediateNetwork(), {"base": (0, 0), "near": (3, 0), "far": (40, 9)},
                  rules=[make(RecordedDelay, path)])
    for label, link in enumerate([("base", "near"), ("far", "base"), ("near", "far")]):
        bench.send(0, *link, 100, 1, label=label)
    assert [(row[0], row[1]) for row in bench.run()] == [(0, 2), (MS, 0), (7 * MS, 1)]


@pytest.mark.parametrize("name", ["recorded_loss", "recorded_delay", "recorded_rate"])
def test_they_keep_the_contract_of_rules(file, name):
    path = file("time_s,source,destination,loss_ratio,delay_s,rate_kbps\n"
                "0,host_1,host_2,0.3,0.01,100\n0.5,host_1,host_10,1,0,0\n"
                "1,host_1,host_2,0,0.2,9000\n0,host_3,host_11,0.5,0.001,50\n")
    check_rule(plugins.load("rule", name), file=path)


@pytest.mark.parametrize(("cls", "text", "says"), [
    (RecordedLoss, WALK + "4,a,b,120,,\n",
     ".rules.0.file: {0}:7: loss_percent is '120'; allowed: 0 to 100"),
    (RecordedDelay, WALK + "4,a,b,,-1,\n",
     ".rules.0.file: {0}:7: delay_ms is '-1'; allowed: 0 to 3600000"),
    (RecordedRate, WALK + "4,a,b,,,fast\n",
     ".rules.0.file: {0}:7: rate_mbps is 'fast'; allowed: 0 to 1000000"),
    (RecordedRate, WALK.replace("rate_mbps", "rate_gbps"),
     ".rules.0.file: {0}:1: unknown column 'rate_gbps' (did you mean 'rate_bps'?); allowed: "
     "time_s, source, destination, channel, delivery_ratio, rssi_dbm, loss_ratio, loss_percent, "
     "delay_s, delay_ms, delay_us, rate_bps, rate_kbps, rate_mbps"),
    (RecordedLoss, "time_s,source,destination,delay_ms\n0,a,b,1\n",
     ".rules.0.file: {0}:1: there is no column of loss_ratio or loss_percent; there are "
     "time_s, source, destination, delay_ms"),
    (RecordedLoss, "time_s,source,destination,loss_ratio\n0,a,b,\n",
     ".rules.0.file: {0}: no row of a link"),
    (RecordedDelay, "time_s,source,destination,delay_ms\n0,x,y,1\n",
     ".rules.0.nodes: the trace has no link between two hosts; it has x, y; hosts are a, b"),
])
def test_broken_files_are_complained_of_in_one_line(file, cls, text, says):
    path = file(text)
    with pytest.raises(InputError) as caught:
        Bench(ImmediateNetwork(), {"a": (0, 0), "b": (9, 0)}, rules=[make(cls, path)])
    assert str(caught.value) == says.format(path)


def test_a_scenario_names_the_file_beside_it(file, tmp_path):
    path = file(WALK)
    scenario = tmp_path / "s.yaml"
    scenario.write_text("name: walk\ndeployment: field\n"
                        "network: {media: {air: {model: ideal, rules: [{rule: recorded_loss,"
                        " file: walk.csv, links: [[robot_1, 'robot_*']]}]}}}\n"
                        "fleet: {size: 2}\n")
    (rule,) = load.load(scenario).scenario.network.media["air"].rules
    assert rule.params.file == path
