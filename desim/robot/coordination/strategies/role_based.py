"""Roles: explorers explore, relays bring their maps to the base (de Hoog et al. 2009)."""

import math

from pydantic import Field

from desim import ports
from desim.robot.coordination.meeting import Meeting, MeetingParams, drive_near, is_near, silent
from desim.robot.coordination.strategies.minpos import MinPos
from desim.units import Duration


class RoleBased:
    """Every second robot is the relay of the explorer before it, and meets it (de Hoog, Cameron,
    Visser 2009, role-based exploration with fixed roles).

    An explorer chooses as ``minpos``. When it has exchanged maps with its relay they agree on the
    next meeting: at the explorer's next frontier, at a time by which the relay can have driven home
    and back to that place. The relay drives home until it hears the host ``base`` or, where there
    is no such host, until it has arrived. Then it drives to the meeting and waits there. The first
    meeting is at the start. The same class on the base announces the base. An explorer without a
    relay only explores.

    Failsafe: a robot that has waited for its partner for ``failsafe_after`` longer than agreed goes
    on alone as ``minpos``, even if it is a relay, until it hears the partner again.
    """

    class Params(MeetingParams):
        base: str = Field("base", description="the host that relays bring maps to")
        failsafe_after_ns: Duration = Field("30 s", description=(
            "wait for the partner: then go on alone (36 m of way at 1.2 m/s)"))

    traits = ports.StrategyTraits(reads_team_state=True)

    def __init__(self, params: Params) -> None:
        self._params, self._minpos = params, MinPos(MinPos.Params())
        self._partner: str | None = None
        self._is_explorer = True  # its role
        self._home: ports.Place | None = None
        self._meeting: Meeting | None = None
        self._is_exploring = True  # to choose frontiers
        self._carries = False  # a relay on its way home
        self._together_ns: int | None = None  # since when the partner is heard at a meeting

    def on_start(self, host: ports.StrategyContext) -> None:
        host.advertise("here")
        host.subscribe("here", lambda *_: None)  # that it was heard is in links()
        if not host.has_body:
            host.every(self._params.fresh_ns // 3, lambda base: base.publish("here", None))
            return
        robots = sorted({host.name, *host.team} - {self._params.base}, key=ports.natural_key)
        number = robots.index(host.name)
        self._is_explorer = number % 2 == 0
        self._partner = next(iter(robots[number + 1:number + 2] if self._is_explorer
                                  else robots[number - 1:number]), None)
        self._is_exploring = self._is_explorer
        host.advertise("meeting")
        host.subscribe("meeting", self._on_meeting)
        if self._partner is not None:
            host.every(self._params.fresh_ns // 3,
                       self._explore if self._is_explorer else self._relay)

    def choose(self, robot: ports.StrategyContext) -> ports.Frontier | None:
        return self._minpos.choose(robot) if self._is_exploring else None

    def _is_set(self, robot: ports.StrategyContext) -> bool:
        """Whether the robot has a pose. With the first one, its home and its first meeting are
        set there."""
        if robot.pose is None:
            return False
        if self._home is None:
            self._home = ports.Place(*robot.pose[:2])
            self._meeting = Meeting(self._home, robot.now_ns + self._params.interval_ns
                                    ).shown(robot)
        return True

    def _hears(self, robot: ports.StrategyContext, name: str | None) -> bool:
        return not silent(robot, [name or ""], self._params.fresh_ns)

    def _start_exploring(self, robot: ports.StrategyContext) -> None:
        """Choose frontiers from now on."""
        self._is_exploring = True
        place = self.choose(robot)
        if place is not None:
            robot.go(place)

    # ------------------------------------------------------------------------------ an explorer

    def _explore(self, robot: ports.StrategyContext) -> None:
        """Leave for the meeting in time, wait there, agree on the next."""
        if not self._is_set(robot) or self._meeting is None:
            return
        params, now_ns, hears = self._params, robot.now_ns, self._hears(robot, self._partner)
        if not hears:
            self._together_ns = None
            if now_ns >= self._meeting.time_ns + params.failsafe_after_ns:
                if not self._is_exploring:
                    self._start_exploring(robot)
                return
            if self._meeting.is_due(robot, params.speed_mps):
                self._is_exploring = False
        if not self._is_exploring:
            self._meeting.drive(robot, params.near_m)
        if hears and (now_ns >= self._meeting.time_ns or not self._is_exploring):
            self._together_ns = self._together_ns or now_ns
            if now_ns >= self._together_ns + params.linger_ns:
                self._propose(robot)

    def _propose(self, robot: ports.StrategyContext) -> None:
        """Agree to meet at the next goal, at a time by which the relay can have driven home and
        from there to it."""
        assert self._home is not None
        self._together_ns, params = None, self._params
        goal = self._minpos.choose(robot)
        place = self._home if goal is None else ports.Place(*goal[:2])
        way_m = float(robot.path_lengths_m([place], self._home)[0])
        trip_s = 2 * way_m / params.speed_mps if math.isfinite(way_m) else 0.0
        time_ns = robot.now_ns + max(params.interval_ns, round(trip_s * 1e9))
        self._meeting = Meeting(place, time_ns).shown(robot)
        robot.publish("meeting", {"with": self._partner, "at": place, "time_ns": time_ns})
        if not self._is_exploring:
            self._start_exploring(robot)

    # --------------------------------------------------------------------------------- a relay

    def _on_meeting(self, robot: ports.StrategyContext, message: ports.StrategyMessage) -> None:
        if message.content["with"] == robot.name and self._is_set(robot):
            self._meeting = Meeting(ports.Place(*message.content["at"]),
                                    message.content["time_ns"]).shown(robot)
            self._is_exploring, self._carries = False, True

    def _relay(self, robot: ports.StrategyContext) -> None:
        """Carry the map home, come back, wait for the explorer."""
        if not self._is_set(robot) or self._meeting is None or self._home is None:
            return
        params = self._params
        if self._hears(robot, self._partner):
            if self._is_exploring:  # it is back: bring home what it knows
                self._is_exploring, self._carries = False, True
                late_ns = robot.now_ns + params.interval_ns
                self._meeting = self._meeting._replace(time_ns=late_ns).shown(robot)
        elif (not self._is_exploring
              and robot.now_ns >= self._meeting.time_ns + params.failsafe_after_ns):
            self._start_exploring(robot)
        if self._is_exploring:
            return
        if self._carries:
            at_home = params.base not in robot.team and is_near(robot, self._home, params.near_m)
            self._carries = not (at_home or self._hears(robot, params.base))
        drive_near(robot, self._home if self._carries else self._meeting.place, params.near_m)
