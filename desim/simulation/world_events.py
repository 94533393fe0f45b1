"""The events of the world: ticks, scans and odometry, each one event for the whole fleet.

All sensors of a rate read at the same instants: reading k is due at k / rate, and sees the pose of
the last world tick (or, if a laser's ``pose`` is ``interpolated``, the pose at the instant itself).
A tick of a whole fleet is one event and one kernel call; the drivers then publish. Sensors of
different kinds have an event each.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial

from desim.engine.kernel import Kernel, Phase
from desim.engine.trace import Trace
from desim.ports import World
from desim.scenario.robot_types import equipment_of
from desim.scenario.schema.scenario import Scenario
from desim.simulation.drivers import Driver, kinds_of_lasers, kinds_of_sonars

WALL = -1
# Order of what is due in one instant: a reader of both finds the scan there when the pose comes.
_TICK, _SCANS, _POSES, _SONARS = range(4)


class WorldEvents:
    """Moves ``world``, and has ``drivers``, those of the hosts that are up, publish the readings of
    sensors.

    ``collided(robot, other)`` is called for each collision episode; other is ``WALL`` for a wall.
    """

    def __init__(self, kernel: Kernel, world: World, trace: Trace, scenario: Scenario,
                 drivers: Sequence[Driver],
                 collided: Callable[[int, int], None]) -> None:
        self._kernel, self._world, self._trace = kernel, world, trace
        self._drivers, self._collided = drivers, collided
        self._ids = [trace.names.id(name) for name in world.robots]
        self._collision = trace.names.id("collision")
        self._wall = trace.names.id("wall")
        kernel.ticker(scenario.physics.rate_hz, Phase.WORLD, _TICK, self._advance, 0)
        equipment = equipment_of(scenario)
        for kind, laser in enumerate(kinds_of_lasers(equipment)):
            kernel.ticker(laser.rate_hz, Phase.SENSE, _SCANS,
                          partial(self._scan, kind, laser.pose == "interpolated"), 0)
        for kind, rate_hz in enumerate(dict.fromkeys(own.odometry.rate_hz for own in equipment)):
            kernel.ticker(rate_hz, Phase.SENSE, _POSES, partial(self._pose, kind), 0)
        for kind, sonar in enumerate(kinds_of_sonars(equipment)):
            kernel.ticker(sonar.rate_hz, Phase.SENSE, _SONARS, partial(self._sonar, kind), 0)

    def _advance(self, tick: int) -> None:
        if tick == 0:  # the start poses
            return
        now_ns = self._kernel.now_ns
        for driver in self._drivers:
            driver.drive()
        self._world.advance(now_ns)
        for robot, other in self._world.contacts():
            self._trace.row(now_ns, self._collision, self._ids[robot],
                            self._wall if other == WALL else self._ids[other])
            self._collided(robot, other)
            for driver in self._drivers:
                driver.bump(robot)
                driver.bump(other)

    def _scan(self, kind: int, interpolated: bool, tick: int) -> None:
        now_ns, world = self._kernel.now_ns, self._world
        snapshot = world.snapshot_at(now_ns) if interpolated else world.snapshot()
        for driver in self._drivers:
            driver.sense_scan(kind, snapshot, tick)

    def _sonar(self, kind: int, tick: int) -> None:
        snapshot = self._world.snapshot()
        for driver in self._drivers:
            driver.sense_sonar(kind, snapshot, tick)

    def _pose(self, kind: int, tick: int) -> None:
        snapshot = self._world.snapshot()
        for driver in self._drivers:
            driver.sense_pose(kind, snapshot, tick)
