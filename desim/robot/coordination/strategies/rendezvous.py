"""Rendezvous: a team meets at agreed places and times to exchange maps (Roy and Dudek 2001)."""

from desim import ports
from desim.robot.coordination.meeting import Meeting, MeetingParams, silent
from desim.robot.coordination.strategies.minpos import MinPos


class Rendezvous:
    """Explore as ``minpos``, and meet the team where and when the last meeting agreed (Roy and
    Dudek 2001, with clocks that agree and one landmark).

    The first meeting is at the start. A robot leaves for it in time, unless it hears all teammates
    already. When all are heard, and maps have been exchanged, the robot that is first by name
    chooses the next place: the frontier with the shortest paths to all others. If a robot is
    missing, the meeting is repeated at the same place after twice the interval. A robot that missed
    two meetings in a row is no longer expected until it is heard again. Failsafe: a robot that has
    waited for ``failsafe_after`` goes on alone until the next meeting.
    """

    Params = MeetingParams

    traits = ports.StrategyTraits(reads_team_state=True)

    def __init__(self, params: MeetingParams) -> None:
        self._params, self._explorer = params, MinPos(MinPos.Params())
        self._meeting: Meeting | None = None
        self._interval_ns = params.interval_ns
        self._attends = False  # it is on its way to the meeting, or there
        self._together_ns: int | None = None  # since when nobody is missing
        self._missed: dict[str, int] = {}  # meetings in a row

    def on_start(self, robot: ports.StrategyContext) -> None:
        robot.advertise("meeting")
        robot.subscribe("meeting", self._on_meeting)
        if robot.has_body:
            robot.every(self._params.fresh_ns // 3, self._keep_appointment)

    def choose(self, robot: ports.StrategyContext) -> ports.Frontier | None:
        return None if self._attends else self._explorer.choose(robot)

    def _keep_appointment(self, robot: ports.StrategyContext) -> None:
        """Leave for the meeting in time, wait there, and end it."""
        if robot.pose is None:
            return
        params, now_ns = self._params, robot.now_ns
        if self._meeting is None:
            self._meeting = Meeting(ports.Place(*robot.pose[:2]), now_ns + params.interval_ns
                                    ).shown(robot)
        meeting, missing = self._meeting, self._missing(robot)
        if self._attends or missing and meeting.is_due(robot, params.speed_mps):
            self._attends = True
            meeting.drive(robot, params.near_m)
        if now_ns < meeting.time_ns:
            return
        if missing:
            self._together_ns = None
            if now_ns >= meeting.time_ns + params.failsafe_after_ns:
                self._repeat(robot, missing)
            return
        self._together_ns = self._together_ns or now_ns
        linger_ns = params.linger_ns if self._attends else 0
        if now_ns >= self._together_ns + linger_ns:
            if self._leads(robot):
                self._propose(robot)
            elif now_ns >= self._together_ns + linger_ns + params.failsafe_after_ns:
                self._repeat(robot, missing)

    def _missing(self, robot: ports.StrategyContext) -> list[str]:
        absent = silent(robot, robot.team, self._params.fresh_ns)
        self._missed = {name: missed for name, missed in self._missed.items() if name in absent}
        return [name for name in absent if self._missed.get(name, 0) < 2]

    def _leads(self, robot: ports.StrategyContext) -> bool:
        absent = silent(robot, robot.team, self._params.fresh_ns)
        present = [robot.name, *(name for name in robot.team if name not in absent)]
        return robot.name == min(present, key=ports.natural_key)

    def _propose(self, robot: ports.StrategyContext) -> None:
        """Agree on the next place: the frontier with the shortest paths to all others."""
        assert self._meeting is not None
        places = [ports.Place(*one[:2]) for one in robot.frontiers()]
        ways_m = [float(robot.path_lengths_m(places, place).sum()) for place in places]
        place = min(zip(ways_m, places, strict=True), default=(0.0, self._meeting.place))[1]
        self._interval_ns = self._params.interval_ns
        self._part(robot, Meeting(place, robot.now_ns + self._interval_ns))
        robot.publish("meeting", [*place, self._meeting.time_ns])

    def _on_meeting(self, robot: ports.StrategyContext, message: ports.StrategyMessage) -> None:
        x_m, y_m, time_ns = message.content
        self._interval_ns = self._params.interval_ns
        self._part(robot, Meeting(ports.Place(x_m, y_m), time_ns))

    def _repeat(self, robot: ports.StrategyContext, missing: list[str]) -> None:
        """Meet again at the same place after twice the interval, as ``missing`` did not come."""
        assert self._meeting is not None
        for name in missing:
            self._missed[name] = self._missed.get(name, 0) + 1
        self._interval_ns *= 2
        self._part(robot, Meeting(self._meeting.place, self._meeting.time_ns + self._interval_ns))

    def _part(self, robot: ports.StrategyContext, meeting: Meeting) -> None:
        """Explore until the next meeting."""
        was_there, self._attends, self._together_ns = self._attends, False, None
        self._meeting = meeting.shown(robot)
        chosen = self.choose(robot) if was_there and robot.pose is not None else None
        if chosen is not None:
            robot.go(chosen)
