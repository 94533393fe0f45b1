"""A team of robots without a simulator, whose messages arrive where the test wants them to."""

from __future__ import annotations

import math

from desim import ports
from desim.testing import StrategyBench
from desim.units import NS_PER_S


def frontiers_at(own, *points, cells=10):
    """Frontiers in the order of the way, which is straight."""
    return sorted((ports.Frontier(float(x), float(y), math.dist(own, (x, y)), cells)
                   for x, y in points), key=lambda one: one.path_m)


class Team:
    """A bench and a strategy for each of ``places`` (name to x, y; None: no body), all of which
    know the frontiers ``points`` and the briefing ``task``. ``deaf`` holds names that no message
    leaves or reaches."""

    def __init__(self, make, places, points=(), task=None):
        self.benches, self.strategies, self.deaf, self._sent = {}, {}, set(), {}
        self.sent = []  # (source, topic, content)
        for name, place in places.items():
            bench = self.benches[name] = StrategyBench(
                [], name, tuple(other for other in places if other != name))
            bench.pose = None if place is None else ports.Pose2D(*map(float, place), 0.0)
            bench.has_body, bench.peers, bench.heard = place is not None, {}, {}
            bench.task = task
            self._sent[name] = 0
            self.strategies[name] = make()
        self.know(*points)
        for name, bench in self.benches.items():
            if hasattr(self.strategies[name], "on_start"):
                self.strategies[name].on_start(bench)

    def know(self, *points):
        """All robots know frontiers there, and no others."""
        self.points = points
        for bench in self.benches.values():
            bench.known = frontiers_at((bench.pose or (0, 0))[:2], *points)

    def meet(self):
        """Those that are not deaf learn each other's poses and goals."""
        for name, bench in self.benches.items():
            for other, its in self.benches.items():
                if name != other and not {name, other} & self.deaf:
                    bench.heard[other] = ports.TeamLink(bench.now_ns)
                    if its.pose is not None:
                        bench.peers = {**bench.peers, other: ports.Peer(
                            *its.pose, bench.now_ns, its.goal)}

    def talk(self):
        """Deliver messages until nobody says any more."""
        while any(self._talk(name) for name in self.benches):
            pass

    def _talk(self, name):
        bench = self.benches[name]
        news, self._sent[name] = bench.published[self._sent[name]:], len(bench.published)
        for message in news:
            self.sent.append((name, message.topic, message.content))
            for other, its in self.benches.items():
                if other != name and not {name, other} & self.deaf:
                    its.heard[name] = ports.TeamLink(its.now_ns)
                    its.deliver(message)
        return bool(news)

    def choose(self, name):
        """The robot is asked, as it has no goal, and drives there."""
        bench = self.benches[name]
        chosen = self.strategies[name].choose(bench)
        if chosen is not None:
            bench.go(chosen)
        self.talk()
        return None if chosen is None else tuple(chosen[:2])

    def wait(self, seconds=1):
        """Time passes, and timers run each second."""
        for _ in range(seconds):
            for bench in self.benches.values():
                bench.now_ns += NS_PER_S
            for bench in self.benches.values():
                bench.run_timers()
                self.talk()

    def drive(self, name, end=ports.GoalEnd.REACHED):
        """The robot's drive ends; if it is reached, the robot is there."""
        bench = self.benches[name]
        place, bench.goal = bench.goal, None
        if end == ports.GoalEnd.REACHED:
            bench.pose = ports.Pose2D(*place, 0.0)
            self.know(*self.points)
        if hasattr(self.strategies[name], "on_goal"):
            self.strategies[name].on_goal(bench, place, end)
        self.talk()

    def goals(self):
        """The place that each robot drives to."""
        return {name: None if bench.goal is None else tuple(bench.goal)
                for name, bench in self.benches.items() if bench.has_body}
