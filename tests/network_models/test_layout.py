"""``desim net layout FILE``: hosts at given places with given flows."""

import json

import pytest
from typer.testing import CliRunner

from desim.cli import app
from desim.netcases.case import play
from desim.testing import check_case
from netmodels.cases.layout import Layout
from netmodels.cases.two_senders import TwoPairs

FLOWS = [{"from": 0, "to": 1}, {"from": 1, "via": [2, 3], "arrivals": "poisson", "period": "20 ms"},
         {"from": 2, "broadcast": True, "arrivals": "periodic", "period": "100 ms"}]


def net(*words):
    return CliRunner().invoke(app, ["net", "layout", *map(str, words)])


def test_a_layout_keeps_the_contract_of_cases():
    check_case(Layout, places=[[0, 0], [10, 0], [20, 0], [30, 0]], flows=FLOWS, duration="1 s")


@pytest.fixture
def file(tmp_path):
    def write(text: str) -> str:
        path = tmp_path / "there.yaml"
        path.write_text(text)
        return str(path)

    return write


def test_the_example_is_played_as_every_case(repository):
    result = net(repository / "scenarios" / "layouts" / "relay.yaml", "--json")
    found = json.loads(result.stdout)
    assert (result.exit_code, found["case"], found["seed"]) == (0, "layout", 1)
    assert found["settings"]["flows"][0]["via"] == [1, 2]
    assert 2 < found["goodput_mbps"] < 10 and found["frames"] > 1000
    hops = 2  # of the chain: two packets each, one of which is in its place
    assert found["lost"].keys() <= {"channel_error", "collision", "out_of_reach", "retry_limit"}
    assert found["attempts"] > hops * found["delivered"] / 4


def test_a_layout_of_two_pairs_is_the_case_of_that_name():
    """The same places, flows and luck by number: the same figures."""
    case = play(TwoPairs(TwoPairs.Params(duration="2 s")).setup(), seed=3)
    layout = play(Layout(Layout.Params(
        preset="ns3_3_44", rate="6 Mb/s", warm_up="500 ms", duration="2 s",
        places=[[0, 0], [10, 0], [0, 40], [10, 40]],
        flows=[{"from": 0, "to": 1}, {"from": 2, "to": 3}])).setup(), seed=3)
    assert layout["goodput_mbps"] == pytest.approx(case["goodput_mbps"], rel=0.03)


def test_what_is_relayed_crosses_each_hop_once():
    """100 packets a second over two hops: as many arrive, and each is sent twice."""
    found = play(Layout(Layout.Params(
        rate="24 Mb/s", places=[[0, 0], [25, 0], [50, 0]],
        flows=[{"from": 0, "via": [1], "to": 2, "arrivals": "periodic", "period": "10 ms"}],
    )).setup())
    assert (found["frames"], found["delivered"], found["attempts"]) == (1000, 1000, 2000)
    assert found["delay_mean_ms"] > 2 * 0.376


HEAD = "places: [[0, 0], [10, 0]]\nflows:\n"


@pytest.mark.parametrize(("text", "says"), [
    (HEAD + "- {from: 0, to: 2}\n", "{file}:3:17: flows.0.to: there is no host 2; allowed: 0 to 1"),
    (HEAD + "- {from: 0}\n",
     "{file}:3:3: flows.0: nobody receives it; allowed: to, via or broadcast: true"),
    (HEAD + "- {from: 0, to: 0}\n", "{file}:3:3: flows.0: it comes to a host twice: 0, 0"),
    (HEAD + "- {from: 0, to: 1, arrivals: poisson}\n",
     "{file}:3:30: flows.0.arrivals: poisson packets need a period, e.g. period: 20 ms"),
    (HEAD + "- {from: 0, broadcast: true}\n",
     "{file}:3:3: flows.0.arrivals: broadcasts have a period; allowed: periodic, poisson"),
    (HEAD + "- {from: 0, to: 1, period: 1 s}\n",
     "{file}:3:28: flows.0.period: a saturated flow has none; allowed: arrivals: periodic, "
     "poisson"),
    (HEAD + "- {from: 0, to: 1}\nrate: 13 Mb/s\n",
     "{file}:4:7: rate: 13 Mb/s is no rate of 11a; allowed: 6 Mb/s, 9 Mb/s, 12 Mb/s, 18 Mb/s, "
     "24 Mb/s, 36 Mb/s, 48 Mb/s, 54 Mb/s"),
    (HEAD + "- {frm: 0, to: 1}\n", "{file}:3:4: flows.0.frm: unknown key (did you mean 'from'?); "
     "allowed: from, to, via, broadcast, payload, arrivals, period"),
    ("places: [[0, 0], [1e9, 0]]\nflows: [{from: 0, to: 1}]\n",
     "{file}:1:18: places.1: allowed: -1e+06 to 1e+06 m"),
    ("flows: [{from: 0, to: 1}]\n",
     "{file}:1:1: the key 'places' is missing: of the hosts, [x, y] in m"),
])
def test_what_is_wrong_has_a_place(file, text, says):
    path = file(text)
    result = net(path)
    assert (result.exit_code, result.stderr.strip()) == (2, says.format(file=path))


@pytest.mark.parametrize(("words", "says"), [
    ((), "FILE is missing"), (("a.yaml", "b.yaml"), "is not one file"),
    (("--rate", "5"), "is not one file"), (("nowhere.yaml",), "nowhere.yaml: no such file"),
])
def test_wrong_words(words, says):
    result = net(*words)
    assert result.exit_code == 2 and says in result.stderr


def test_the_help_lists_the_keys_of_the_file():
    said = net("--help").stdout
    assert all(key in said for key in ("flows[].via", "broadcast_rate", "places", "--seed"))
