"""``replay``: what a trace says of a link is what becomes of frames, from row to row."""

import gzip
import math

import numpy as np
import pytest

from desim.errors import InputError
from desim.scenario import load
from desim.scenario.resolved import resolved, scenario_id
from desim.testing import Bench, check_network
from netmodels.attempts import TRIES, Attempts
from netmodels.radio.delivery import delivery
from netmodels.radio.rate_control import RateControl
from netmodels.radio.standards import STANDARDS, psdu_bytes
from netmodels.replay import Replay

MS, S = 10**6, 10**9

PLAIN = """time_s,source,destination,delivery_ratio
0,a,b,0.2
10,a,b,1
20,a,b,0
5,b,a,1
"""

K7 = """{"location": "grenoble", "start_date": "2018-01-11 16:33:00", "channels": [11, 12]}
datetime,src,dst,channel,mean_rssi,pdr,tx_count,transaction_id
2018-01-11 16:33:00,18,19,11,-53.2,1.0,100
2018-01-11 16:33:00,18,19,12,-70.0,0.5,100,0
2018-01-11 16:33:07,18,19,12,,0.0,100,0
2018-01-11 16:33:07,,19,12,-60,0.5,100,0
"""


@pytest.fixture
def file(tmp_path):
    def written(text):
        path = tmp_path / "trace.csv"
        path.write_text(text)
        return str(path)
    return written


def make(file, **params):
    return Replay(Replay.Params(file=file, **params))


def share(model, link="ab", frames=2000, from_s=0.0, size_bytes=100, segments=1):
    """Of so many frames, one a millisecond, those that arrive."""
    bench = Bench(model, {"a": (0, 0), "b": (math.nan, 0), "c": (1, 1)})
    for label in range(frames):
        bench.send(round(from_s * S) + label * MS, *link, size_bytes, segments, label=label)
    return sum(fate == "arrived" for *_, fate in bench.run()) / frames


def near(found, chance, frames=2000):
    return abs(found - chance) < 3.3 * math.sqrt(chance * (1 - chance) / frames)


def test_a_value_holds_until_the_next_and_the_last_one_to_the_end(file):
    path = file(PLAIN)
    assert near(share(make(path)), 0.2)
    assert near(share(make(path), segments=2), 0.04)
    found = {from_s: share(make(path), from_s=from_s, frames=1)
             for from_s in (10.0, 19.999999, 20.0, 3000.0)}
    assert found == {10.0: 1, 19.999999: 1, 20.0: 0, 3000.0: 0}
    assert share(make(path, begin="10 s"), frames=1) == 1


def test_the_twin_a_tenth_more_delivery_shows(file):
    assert not near(share(make(file(PLAIN.replace("0.2", "0.25")))), 0.2)


def test_links_have_directions_and_what_the_trace_does_not_say_is_otherwise(file):
    path = file(PLAIN)
    assert [share(make(path), "ba", 1, from_s) for from_s in (0, 5)] == [0, 1]
    assert share(make(path), "ac", 1) == 0
    assert near(share(make(path, otherwise="60 %"), "ac"), 0.6)
    assert near(share(make(path, otherwise="60 %"), "ba"), 0.6)
    assert share(make(path, otherwise="60 %"), "ba", 1, 5) == 1


def test_k7_rows_count_from_the_start_date_and_channels_share_a_link(file):
    """The row without a source is a mean over several links, and of none of them."""
    path, nodes = file(K7), {"a": 18, "b": "19"}
    assert near(share(make(path, nodes=nodes)), 0.75)
    assert near(share(make(path, nodes=nodes), from_s=7), 0.5)
    assert near(share(make(path, nodes=nodes, channel=12)), 0.5)
    assert share(make(path, nodes=nodes, channel=12), from_s=7, frames=1) == 0


def by_errors(rssi_dbm, size_bytes):
    g = STANDARDS["11g"]
    return float(delivery(rssi_dbm, g, g.rate(54), psdu_bytes(size_bytes, 1),
                          Replay.Params(file="").reception.for_stations()))


def test_an_rssi_is_what_the_radios_errors_make_of_it(file):
    level_dbm = -72.3
    path = file(f"time_s,source,destination,rssi_dbm\n0,a,b,{level_dbm}\n9,a,b,\n")
    long, short = by_errors(level_dbm, 1500), by_errors(level_dbm, 100)
    assert 0.1 < long < short - 0.1
    once = {"rate_control": None}
    assert near(share(make(path, **once), size_bytes=1500), long)
    assert near(share(make(path, **once), size_bytes=100), short)
    assert share(make(path), from_s=9, frames=1) == 0
    assert not near(share(make(path, reception={"noise_figure": "7.5 dB"}, **once),
                          size_bytes=1500), long)


RSSI = "time_s,source,destination,rssi_dbm\n"


def lost(model, frames=360, size_bytes=200):
    """The share of messages, two a second, that do not arrive."""
    bench = Bench(model, {"a": (0, 0), "b": (0, 0)})
    for label in range(frames):
        bench.send(label * S // 2, "a", "b", size_bytes, label=label)
    return sum(fate != "arrived" for *_, fate in bench.run()) / frames


@pytest.mark.parametrize(("rssi_dbm", "gone", "share", "at_54_mbps"), [
    ([-51, -59], 0, 0.0, 0.0), ([-55, -61], 0, 0.0, 0.0), ([-78, -85], 0.46, 0.46, 1.0),
    ([-63, -79], 0, 0.0, 0.5)])
def test_a_station_that_learns_its_rate_loses_what_it_lost_in_a_shipyard(
        file, rssi_dbm, gone, share, at_54_mbps):
    """RSSI and losses as at four places there (minarady1/wifi_for_industrial_robotics: 0, 0, 57 and
    0 % lost; at the third the station was away in 46 % of the rows, and came back late): the two
    ends of each range in turns."""
    rows = [(k / 2, rssi_dbm[k % 2] if k % 60 >= 60 * gone else "") for k in range(360)]
    path = file(RSSI + "".join(f"{time_s},a,b,{dbm}\n" for time_s, dbm in rows))
    assert lost(make(path, standard="11a")) == pytest.approx(share, abs=0.05)
    assert lost(make(path, standard="11a", rate_control=None)) == pytest.approx(
        at_54_mbps, abs=0.05)


def arrivals_ns(model, frames, size_bytes=1500, **kwargs):
    """The time from sending to arriving of each of so many frames, which are a second apart."""
    bench = Bench(model, {"a": (0, 0), "b": (0, 0)})
    for label in range(frames):
        bench.send(label * S, "a", "b", size_bytes, label=label, **kwargs)
    return [time_ns - label * S for time_ns, label, _, _, fate in bench.run() if fate == "arrived"]


def test_each_attempt_takes_its_time_at_the_rate_that_was_learnt(file):
    """At -79 dBm 36 Mb/s and more get nothing through, 24 Mb/s all."""
    path = file(RSSI + "0,a,b,-79\n")
    at = {mbps: 1500 * 8 * 1000 // mbps for mbps in (54, 48, 36, 24, 6)}
    found = arrivals_ns(make(path), 12)
    assert found[0] == pytest.approx(2 * (at[54] + at[48] + at[36]) + at[24], abs=9)
    assert found[1:10] == [at[24]] * 9
    assert found[10] == pytest.approx(at[36] + at[24], abs=9)  # a probe after ten
    assert arrivals_ns(make(path), 2, broadcast=True) == [at[6], at[6]]


def test_attempts_arrive_unless_all_seven_fail():
    draw = np.random.default_rng(1)
    attempts = Attempts(RateControl(), STANDARDS["11a"], 7, np.random.default_rng, lambda *_: 0.0)
    arrived = [attempts.packet(0, 1, 100, 0, lambda rate: 0.3, draw.random(TRIES))[0]
               for _ in range(4000)]
    assert near(np.mean(arrived), 1 - 0.7 ** 7, 4000)
    assert not near(np.mean(arrived), 1 - 0.7 ** 6, 4000)


def test_packets_of_a_train_are_repeated_one_by_one(file):
    """At -79 dBm, beginning at 24 Mb/s, none is lost; where nothing is heard all are."""
    path = file(RSSI + "0,a,b,-79\n9,a,b,\n")
    bench = Bench(make(path, rate="24 Mb/s"), {"a": (0, 0), "b": (0, 0)})
    bench.send(0, "a", "b", 4500, 3, label="heard")
    bench.send(10 * S, "a", "b", 4500, 3, label="unheard")
    assert [(label, fate) for _, label, _, _, fate in bench.run()] == [
        ("heard", "arrived"), ("unheard", "out_of_range")]


SURVEY = """x_m,y_m,node,delivery_ratio
0,0,base,1
10,0,base,0
10,0,base,0.5
0,8,base,0
0,0,mast,0
"""


def surveyed(path, there, link=("base", "robot"), frames=1, **params):
    bench = Bench(make(path, **params), {"base": (50, 50), "robot": there, "mast": (0, 0),
                                         "guest": (math.nan, math.nan)})
    for label in range(frames):
        bench.send(label * MS, *link, 100, label=label)
    return sum(fate == "arrived" for *_, fate in bench.run()) / frames


@pytest.mark.parametrize(("there", "share"), [
    ((1, 2), 1), ((4.9, 0), 1), ((-900, -900), 1), ((3, 7), 0), ((0, 4), 1), ((0, 4.1), 0)])
def test_the_nearest_place_of_a_survey_counts(file, there, share):
    """In both directions, however far it is; the first by x and y of two that are equally near."""
    path = file(SURVEY)
    assert surveyed(path, there) == surveyed(path, there, ("robot", "base")) == share


def test_rows_of_one_place_count_equally_often(file):
    assert near(surveyed(file(SURVEY), (11, 1), frames=2000), 0.25)


def test_links_that_a_survey_does_not_have(file):
    """Between two nodes the source's rows count; hosts without a place have no nearest one."""
    path = file(SURVEY)
    assert surveyed(path, (0, 0), ("base", "mast")) == 1
    assert surveyed(path, (0, 0), ("mast", "base")) == 0
    for link in ("robot", "guest"), ("base", "guest"):
        assert [surveyed(path, (0, 0), link, otherwise=chance) for chance in (0, 1)] == [0, 1]


def test_a_log_of_a_drive_is_a_survey(file):
    """Its times are passed over; an RSSI is one."""
    path = file("time_s,x_m,y_m,node,channel,rssi_dbm\n0,0,0,a,1,-50\n5,9,0,a,1,\n")
    for x_m, arrived in (1, 1), (8, 0):
        bench = Bench(make(path), {"a": (0, 0), "b": (x_m, 0)})
        bench.send(20 * S, "a", "b", 100)
        assert sum(fate == "arrived" for *_, fate in bench.run()) == arrived


def test_a_trace_may_have_both_and_may_be_packed(tmp_path):
    path = tmp_path / "trace.k7.gz"
    path.write_bytes(gzip.compress(K7.encode()))
    nodes = {"a": "18", "b": "19"}
    assert near(share(make(str(path), nodes=nodes)), 0.75)
    assert near(share(make(str(path), nodes=nodes, quantity="rssi_dbm", rate_control=None)),
                (by_errors(-53.2, 100) + by_errors(-70.0, 100)) / 2)


def test_it_keeps_the_contract(file):
    path = file("time_s,source,destination,delivery_ratio\n0,host_1,host_2,0.5\n"
                "0,host_2,host_10,1\n1,host_2,host_10,0\n1.5,host_2,host_10,0.2\n")
    check_network(Replay, file=path)
    check_network(Replay, file=path, otherwise=0.1)
    check_network(Replay, file=file("x_m,y_m,node,rssi_dbm\n0,0,host_2,-60\n9,0,host_2,-88\n"))


def test_hosts_without_a_link_now_are_parted(file):
    bench = Bench(make(file(PLAIN)), {"a": (0, 0), "b": (0, 0)})
    assert bench.medium.linked(np.arange(2)).tolist() == [[False, True], [False, False]]


@pytest.mark.parametrize(("text", "says"), [
    ("", "{0}:1: the column 'time_s' is missing; there are "),
    ("time_s,source,destination,pdr\n", "{0}:1: unknown column 'pdr'; allowed: time_s, source, "
     "destination, channel, delivery_ratio, rssi_dbm, loss_ratio, loss_percent, delay_s, delay_ms, "
     "delay_us, rate_bps, rate_kbps, rate_mbps"),
    ("time_s,source,delivery_ratio\n",
     "{0}:1: the column 'destination' is missing; there are time_s, source, delivery_ratio"),
    ("time_s,source,destination\n", "{0}:1: there is no column of delivery_ratio or rssi_dbm; "
     "there are time_s, source, destination"),
    ("time_s,source,destination,rssi_dbm\n", "{0}: no row of a link"),
    (PLAIN + "x,a,b,1\n", "{0}:6: time_s is 'x'; allowed: seconds, at least 0"),
    (PLAIN + "30,a,b,1.4\n", "{0}:6: delivery_ratio is '1.4'; allowed: 0 to 1"),
    (PLAIN + "30,a,b,nan\n", "{0}:6: delivery_ratio is 'nan'; allowed: 0 to 1"),
    (PLAIN + "\n30,a,b\n", "{0}:7: delivery_ratio is ''; allowed: 0 to 1"),
    (PLAIN + "30,a,,1\n", "{0}:6: source or destination is missing"),
    (PLAIN + "30,a,b,1,2\n", "{0}:6: 5 cells; allowed: at most 4, one for each column"),
    ("{'start_date': 3}\n", "{0}:1: this is no JSON: Expecting property name enclosed in double "
                            "quotes: line 1 column 2 (char 1)"),
    ('{"a": ' + "[" * 100_000, "{0}:1: this JSON is nested too deeply"),
    ("t" * 200_000, "{0}:1: this is no CSV: field larger than field limit (131072)"),
    (K7.replace("2018-01-11 16:33:07,18", "yesterday,18"),
     "{0}:5: datetime is 'yesterday'; allowed: a date and time as 2018-01-11 16:33:07"),
    (K7.replace("2018-01-11 16:33:07,18", "2018-13-11 16:33:07,18"),
     "{0}:5: datetime is '2018-13-11 16:33:07'; allowed: a date and time as 2018-01-11 16:33:07"),
    (K7.replace("2018-01-11 16:33:00\"", "soon\""),
     "{0}:1: start_date is 'soon'; allowed: a date and time as 2018-01-11 16:32:22"),
    ("x_m,y_m,rssi_dbm\n", "{0}:1: the column 'node' is missing; there are x_m, y_m, rssi_dbm"),
    ("x_m,node,rssi_dbm\n", "{0}:1: the column 'y_m' is missing; there are x_m, node, rssi_dbm"),
    (SURVEY + "near,0,base,1\n", "{0}:7: x_m is 'near'; allowed: metres"),
    (SURVEY + "0,1e9,base,1\n", "{0}:7: y_m is '1e9'; allowed: metres"),
    (SURVEY + "0,1,,1\n", "{0}:7: node is missing"),
    (SURVEY.splitlines()[0] + "\n", "{0}: no row of a place"),
    (SURVEY, ".nodes: no host is a node of the survey; it has base, mast; hosts are a, b"),
    (K7.replace("19,11", "19,eleven"), "{0}:3: channel is 'eleven'; allowed: a number, or nothing"),
])
def test_damaged_files_are_complained_of_in_one_line(file, text, says):
    path = file(text)
    with pytest.raises(InputError) as caught:
        Bench(make(path), {"a": (0, 0), "b": (0, 0)})
    assert str(caught.value) == ("" if says.startswith(".") else ".file: ") + says.format(path)


@pytest.mark.parametrize(("params", "says"), [
    ({"file": "/nowhere.csv"}, ".file: /nowhere.csv: cannot be read: No such file or directory"),
    ({"channel": 26}, ".file: {0}: no row of a link on channel 26"),
    ({"quantity": "rssi_dbm"}, ".file: {0}:1: there is no column of rssi_dbm; there are "
     "time_s, source, destination, delivery_ratio"),
    ({"nodes": {"d": "a"}}, ".nodes: no host 'd'; hosts are a, b, c"),
    ({"nodes": {"c": "d"}}, ".nodes.c: the trace has no node 'd'; it has a, b"),
    ({"nodes": {"c": "b"}}, ".nodes.c: node 'b' is host 'b' already"),
    ({"nodes": {"c": "b", "b": "c"}}, ".nodes.b: the trace has no node 'c'; it has a, b"),
])
def test_what_does_not_fit_the_trace_is_refused(file, params, says):
    path = file(PLAIN)
    with pytest.raises(InputError) as caught:
        Bench(make(**{"file": path, **params}), {"a": (0, 0), "b": (0, 0), "c": (0, 0)})
    assert str(caught.value) == says.format(path)


def test_a_survey_has_no_times(file):
    with pytest.raises(InputError, match=r"^\.begin: a survey is of places, and has no times$"):
        surveyed(file(SURVEY), (0, 0), begin="5 s")


def test_an_rssi_needs_a_rate_of_the_standard(file):
    path = file("time_s,source,destination,rssi_dbm\n0,a,b,-60\n")
    with pytest.raises(InputError, match=r"\.rate: 7 Mb/s is no rate of 11g; allowed: 1 Mb/s"):
        Bench(make(path, rate="7 Mb/s"), {"a": (0, 0), "b": (0, 0)})


SCENARIO = """name: traced
deployment: field
fleet: {size: 2}
network: {media: {air: {model: 'netmodels.replay:Replay', file: traces/day.csv}}}
"""


def test_the_file_lies_beside_the_scenario_wherever_that_is(tmp_path, monkeypatch):
    """Its content, and not its place, belongs to the run's identity."""
    def written(folder, ratio):
        (folder / "traces").mkdir(parents=True)
        (folder / "traces" / "day.csv").write_text(
            f"time_s,source,destination,delivery_ratio\n0,robot_0,robot_1,{ratio}\n")
        (folder / "s.yaml").write_text(SCENARIO)
        return load.load(folder / "s.yaml").scenario

    one = written(tmp_path / "one", 0.5)
    assert one.network.media["air"].params.file == str(tmp_path / "one/traces/day.csv")
    other, third = written(tmp_path / "other", 0.5), written(tmp_path / "third", 0.6)
    ids = [scenario_id(scenario, {})(1) for scenario in (one, other, third)]
    assert ids[0] == ids[1] != ids[2]
    (tmp_path / "run").mkdir()
    again = tmp_path / "run" / "scenario.resolved.yaml"
    again.write_text(resolved(one, tmp_path / "run"))
    assert "file: ../one/traces/day.csv" in again.read_text()
    assert load.load(again).scenario == one
