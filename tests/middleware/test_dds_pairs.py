"""The pairs of participants that have found each other, as the middleware counts them."""

import pytest
from configured import configured
from graphs import MS, Net, S, silent
from recorded import made

from desim.middleware.dds.dds import Dds


def net(hosts=3, **params):
    return Net({f"robot_{k}": silent for k in range(hosts)},
               middleware=Dds(configured(Dds.Params, **params)))


@pytest.mark.parametrize(("params", "pairs"), [
    ({"preset": "fastdds", "participants": 4}, 12 * 11),
    ({"preset": "cyclonedds", "participants": 2}, 6 * 5),
    ({"preset": "fastdds", "participants": 4, "domains": {"robot_2": 7}}, 8 * 7 + 4 * 3),
    ({"preset": "fastdds", "participants": 4, "discovery": "server", "server": "robot_0"}, 2 * 8)],
    ids=["fastdds", "cyclonedds", "domains", "server"])
def test_all_are_found_in_the_end(params, pairs):
    all_of_them = net(**params)
    assert all_of_them.run(1 * MS).graph.middleware.pairs() == (0, pairs)
    assert all_of_them.run(10 * S).graph.middleware.pairs() == (pairs, pairs)


def test_one_that_is_gone_is_in_no_pair():
    three = net(preset="fastdds", participants=2).run(10 * S)
    three.graph.hosts[2].stop()
    assert three.run(11 * S).graph.middleware.pairs() == (4 * 3, 4 * 3)


def test_the_summary_and_the_samples_have_them(repository, tmp_path):
    run = made(repository, tmp_path, "deployment=field", "stop.elapsed=4 s", "measure.every=1 s",
               "middleware={model: dds, participants: 3}")
    found = run.metrics["process_pairs"]
    pairs = found["pairs"]
    assert found == {"matched": pairs, "pairs": pairs, "all_s": 1.0} and pairs > 0
    assert list(run.samples["matched_pairs"][1:]) == [1.0] * (len(run.samples["time_s"]) - 1)
