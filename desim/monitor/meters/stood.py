"""The longest time that each robot stood although it had goals."""

from __future__ import annotations

from desim.monitor.meters.meter import Meter, Second
from desim.monitor.samples import Sample
from desim.robot.navigation.standing import Standing
from desim.units import NS_PER_S


class LongestStands(Meter):
    """``stood_s`` of each robot, by its true place each second: see ``Standing``. A robot that
    knows its place badly may believe that it drives."""

    def __init__(self, robots: tuple[str, ...]) -> None:
        self._robots = robots
        self._standing = {name: Standing() for name in robots}
        self._longest_ns = dict.fromkeys(robots, 0)
        self._with_goal: set[str] = set()
        self.listeners = {"goal": self._sets_out, "goal_reached": self._ends,
                          "goal_aborted": self._ends}

    def _sets_out(self, robot: str, *_: int) -> None:
        self._with_goal.add(robot)

    def _ends(self, robot: str, *_: int) -> None:
        self._with_goal.discard(robot)

    def each_second(self, second: Second) -> None:
        for name, (x_m, y_m, _) in zip(self._robots, second.poses.tolist(), strict=True):
            if name in self._with_goal:
                stood_ns = self._standing[name].note(second.now_ns, x_m, y_m)
                self._longest_ns[name] = max(self._longest_ns[name], stood_ns)

    def by_host(self, now_ns: int) -> dict[str, Sample]:
        """Seconds of each robot."""
        return {name: {"stood_s": long_ns / NS_PER_S} for name, long_ns in self._longest_ns.items()}

    def summary(self, now_ns: int) -> Sample:
        """Seconds of the robot that stood longest."""
        return {"stood_s": max(self._longest_ns.values(), default=0) / NS_PER_S}
