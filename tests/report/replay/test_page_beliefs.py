"""The beliefs that a replay shows: who takes whom for online, as a table."""

import numpy as np
from unpacking import unpacked

from desim.report.replay.beliefs import add_beliefs
from desim.report.replay.columns import Columns
from desim.results.recording import Event

HOSTS = ["base", "robot_0", "robot_1"]


def test_beliefs_are_a_table():
    columns = Columns()
    add_beliefs(columns, [Event(7, "sees", "robot_0", "base  online  0"),
                          Event(8, "believes", "robot_0", "base  /map  1"),
                          Event(9, "sees", "base", "robot_1  removed  0")], HOSTS)
    found = unpacked(columns.index, columns.text())
    assert np.stack([found[f"sees.{name}"][0] for name in (
        "ns", "believer", "other", "state")]).T.tolist() == [[7, 1, 0, 1], [9, 0, 2, 3]]
