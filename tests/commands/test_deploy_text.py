"""``desim deploy``: the cluster of a design, as text and as JSON."""

import json

import pytest
from designs import deployed
from typer.testing import CliRunner

from desim.cli import app


@pytest.fixture(scope="module")
def design(tmp_path_factory):
    return deployed(tmp_path_factory.mktemp("design"))


def test_one_of_each(tmp_path):
    file = deployed(tmp_path, sizes=[1])
    shown = CliRunner().invoke(app, ["deploy", str(file), "--image", "20 MB"])
    assert "deployed: 1 node for 1 virtual machine, up to 4 on a node" in shown.output


def test_the_command(design):
    shown = CliRunner().invoke(app, ["deploy", str(design), "--image", "20 MB"])
    assert shown.exit_code == 0, shown.output
    for line in ("deployed: 2 nodes for 6 virtual machines, up to 4 on a node",
                 "node_1  robot_4, robot_5", "Copies of an image of 20 MB over switch, 1 Gb/s:",
                 "server to node_0", "6 to 15 runs in real time"):
        assert line in shown.output
    answer = json.loads(CliRunner().invoke(
        app, ["deploy", str(design), "--image", "20 MB", "--json"]).stdout)
    assert answer["nodes"]["node_1"] == ["robot_4", "robot_5"]
    assert answer["copying"]["passed_on"]["rounds"] == [[["server", "node_0"]],
                                                         [["server", "node_1"]]]
    assert answer["real_time_s"] == {"least": 600.0, "most": 1500.0}


def test_ways_of_copying_are_compared_by_their_time(tmp_path):
    """28 machines on 7 nodes: 28 copies in turn, 7 in turn, or 7 in three rounds, as each node that
    has the image passes it on and 1 + 2 + 4 are 7."""
    shown = CliRunner().invoke(app, ["deploy", str(deployed(tmp_path, sizes=[28])),
                                     "--image", "20 MB"])
    lines = shown.output.splitlines()
    table = lines[lines.index("Copies of an image of 20 MB over switch, 1 Gb/s:") + 1:][:5]
    assert [line.rstrip()[33:] for line in table] == [
        "  copies  rounds  seconds  against naive",
        "      28      28      4.8",
        "       7       7      1.2   4.0 x faster",
        "       7       1      1.2   4.0 x faster",
        "       7       3      0.5   9.3 x faster"]


@pytest.mark.parametrize(("words", "says"), [
    (["--image", "4 apples"], "--image: unknown unit 'apples' for a size"),
    (["--image", "4"], "--image: '4' has no unit; allowed: B, kB, MB"),
    (["--rate", "1"], "--rate: '1' has no unit"),
    (["--rate", "0 b/s"], "--rate: '0 b/s' must be above zero"),
    (["--model", "swich"], "swich"),
    (["--model", "bus"], "--model bus.propagation: "),
    (["--model", "radio", "--rate", "54 Mb/s", "--image", "5 MB"], "the network loses every part"),
])
def test_wrong_options(design, words, says):
    shown = CliRunner().invoke(app, ["deploy", str(design), *words])
    assert shown.exit_code == 2 and says in shown.output
