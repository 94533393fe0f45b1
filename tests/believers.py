"""Three hosts that believe something of each other, and stop doing so."""

from __future__ import annotations

import numpy as np
from graphs import Net, S

from desim.results.beliefs import folded
from desim.results.traces import Rows


def speaker(node):
    node.advertise("/news")
    node.advertise(f"/report/{node.host.name}")


def hearer(node):
    node.subscribe("/news", lambda message: None)
    node.subscribe("/report/robot_0", lambda message: None)


class Two:
    """robot_0 says two topics, robot_1 and robot_2 hear them; all know that after 1 s."""

    def __init__(self, middleware):
        self.net = Net({"robot_0": speaker, "robot_1": hearer, "robot_2": hearer},
                       middleware=middleware)
        self.net.at(4 * S, self.net.graph.host("robot_2").stop)
        self.net.run(20 * S)

    def at(self, time_s, informed="publisher", linked=None):
        self.net.trace.flush()
        rows = np.concatenate(self.net.batches)
        return folded(Rows(rows, self.net.names.items()), round(time_s * S), informed, linked)


def among(*hosts):
    """Frames get from each of these to each other one, and to nobody else."""
    return {(one, other): True for one in hosts for other in hosts if one != other}


TOPICS = ("/news", "/report/robot_0")


def of(knowledge, believer, other):
    return next(view for view in knowledge.views if view[:2] == (believer, other))
