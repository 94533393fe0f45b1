"""``faults: {kind: software}``: the programs of a host stop, and its radio stays where it is."""

import pytest
from recorded import made

from desim.units import NS_PER_S


@pytest.fixture(scope="module")
def runs(repository, tmp_path_factory):
    folder = tmp_path_factory.mktemp("results")
    return {kind: made(
        repository, folder / kind, "fleet.size=3", "stop.elapsed=25 s", "trace.keep=messages",
        f"faults=[{{kind: {kind}, at: 5 s, host: robot_1, down_for: 3 s}}]",
        file="one_access_point.yaml") for kind in ("software", "stop")}


def heard_again_s(run):
    """The first arrival of a message of robot_1 after its fault."""
    messages = run.table("messages", ("source", "fate", "end_ns"))
    return min(end_ns for source, fate, end_ns in zip(*map(list, messages.values()), strict=True)
               if (source, fate) == ("robot_1", "delivered") and end_ns > 8 * NS_PER_S) / NS_PER_S


def test_the_radio_stays_with_its_access_point(runs):
    assert runs["software"].metrics["handovers"] == []
    [joined] = [one["host"] for one in runs["stop"].metrics["handovers"]]  # the twin
    assert joined == "robot_1"


def test_it_talks_at_once_when_it_runs_again(runs):
    """Its radio need not join first, which takes a scan of all channels."""
    assert heard_again_s(runs["software"]) + 2 < heard_again_s(runs["stop"])
