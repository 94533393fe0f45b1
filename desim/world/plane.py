"""The plane: the ``World`` of robots that drive on flat ground between walls."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from fractions import Fraction
from functools import cached_property
from math import isfinite

import numpy as np

from desim import ports
from desim.errors import InputError, ModelError
from desim.ports import (
    GridSpec,
    Obstacles,
    RandomStreams,
    Snapshot,
    materials,
    natural_key,
)
from desim.scenario.schema.environment import Environment
from desim.scenario.schema.fleet import BodyType
from desim.scenario.schema.robot import SCAN
from desim.scenario.schema.scenario import Scenario
from desim.units import NS_PER_S
from desim.world import lidar, odometry, placement, scenery, sources
from desim.world.bodies import PlaneBodies
from desim.world.fleet import RobotSpec, place_fleet
from desim.world.foreign_bodies import ForeignBodies
from desim.world.led_bodies import LedBodies
from desim.world.obstacles import Matter, crossing, toll
from desim.world.outlines import Outlines
from desim.world.path_doubts import path_doubts
from desim.world.people import Crowd
from desim.world.scene import Scene


class Plane:
    """Terrain, bodies and sensors on a base tick. Implements ``ports.World``.

    ``fleet`` may come in any order; robots are indices into ``robots``, their names in natural
    order. Raises ``InputError`` for terrain that cannot be read and for starts that are not free.
    """

    def __init__(self, environment: Environment, fleet: list[RobotSpec], rate_hz: Fraction,
                 streams: RandomStreams, bodies: ports.Bodies | None = None) -> None:
        self.terrain, tick_s = sources.load(environment.terrain), float(1 / rate_hz)
        self._doors = scenery.Doors(environment.doors, self.terrain.bounds)
        self._movers = scenery.Movers(environment.moving_obstacles, self.terrain, tick_s)
        specs = sorted(fleet, key=lambda spec: natural_key(spec.name))
        self.robots = tuple(spec.name for spec in specs)
        site = placement.Site(self.terrain, self._doors.lines[self._doors.closed],
                              self._movers.discs, lambda name: streams("robot", name, "start"))
        specs = site.place(specs)
        self._doubts = (*self.terrain.doubts, *path_doubts(specs, self.terrain))
        self._types = [spec.body for spec in specs]
        self._planes_m = [plane_m for spec in specs for plane_m in spec.planes_m]
        self._radii_m = np.array([spec.body.radius_m for spec in specs])
        self._crowd = Crowd(environment.people, self.terrain, np.array(
            [(spec.x_m, spec.y_m, spec.body.radius_m) for spec in specs]).reshape(-1, 3), streams)
        self._discs = np.concatenate([self._movers.discs, self._crowd.discs])
        self._obstacles: Obstacles | None = None
        self._epoch = 0
        led = any(spec.path is not None for spec in specs)
        self._bodies: PlaneBodies | ForeignBodies = (
            (LedBodies if led else PlaneBodies)(specs, self.terrain, tick_s) if bodies is None
            else ForeignBodies(bodies, self._arena(specs, tick_s)))
        self.lidars = self._lidars(specs, streams)
        keys = self._keys(streams, "odometry")
        kinds = list(dict.fromkeys(spec.odometry for spec in specs))
        self._odometers = [odometry.Odometers(kind, self._bodies.poses, keys) for kind in kinds]
        self._odometer = [kinds.index(spec.odometry) for spec in specs]
        self._tick = 0
        self._now_ns = 0
        # Tick k is at k * period ns, rounded down, in integers: fractions are slow.
        self._period = (NS_PER_S / rate_hz).as_integer_ratio()
        self._next_ns = self._period[0] // self._period[1]
        self._contacts: list[tuple[int, int]] = []
        self._lively = bool(environment.doors or len(self._discs))
        self._walks = any(kind.walks for kind in self._odometers)
        self._snapshot: Snapshot | None = None
        self._walls, self._tops_m = self._standing_walls()
        self._bodies.surround(self._walls, self._tops_m, self._discs)
        self._scene = self._present_scene()

    def doubts(self) -> tuple[str, ...]:
        """Sentences on what is likely to be wrong with the files of terrain and paths."""
        return self._doubts

    def _lidars(self, specs: list[RobotSpec], streams: RandomStreams) -> list[list[lidar.Lidar]]:
        """The lasers of each robot, and then its sonar's transducers; those of one kind and height
        with noise of one name share one ``Lidar``."""
        # Lasers at the height of another one see it.
        extents_m = np.array([(spec.body.altitude_m, spec.top_m) for spec in specs])
        kinds = [[(laser, spec.body.altitude_m + laser.height_m,
                   "laser" if topic == SCAN else topic)
                  for topic, laser in (*spec.lasers.items(),
                                       *(("sonar", cone) for cone in spec.cones))]
                 for spec in specs]
        outlines = Outlines(self._types)
        made = {kind: lidar.Lidar(kind[0], kind[1], self.terrain, self._doors.height_m,
                                  self._radii_m, outlines, extents_m,
                                  self._keys(streams, kind[2]))
                for kind in dict.fromkeys(kind for own in kinds for kind in own)}
        return [[made[kind] for kind in own] for own in kinds]

    def _present_scene(self) -> Scene:
        return Scene(self._walls, self._tops_m, len(self.terrain.lines), self._discs,
                     len(self._movers.discs),
                     tuple(kind.reckoned for kind in self._odometers))

    def _keys(self, streams: RandomStreams, sensor: str) -> np.ndarray:
        return np.array([streams.key("robot", name, sensor) for name in self.robots],
                        dtype=np.uint64)

    @property
    def velocities(self) -> np.ndarray:
        """[robots, 3] forward, left m/s, turn rad/s: the true ones, a copy."""
        return self._bodies.velocities.copy()

    def body(self, robot: int) -> BodyType:
        """The type of ``robot``'s body."""
        return self._types[robot]

    def grid(self, resolution_m: float) -> GridSpec:
        """The raster for maps of this terrain."""
        return self.terrain.grid(resolution_m)

    def ground(self, spec: GridSpec, robots: Sequence[int]) -> tuple[np.ndarray, np.ndarray]:
        """[height, width] uint8, 0 where a cell is free, and bool, the free cells that lasers can
        come to see from where ``robots`` stand now. A wall that no laser of the fleet sees is free;
        one that some look over hides nothing. Without robots all free cells count."""
        if not self._planes_m:
            truth = self.terrain.truth(spec)
            return truth, truth == 0
        starts = self._bodies.poses[list(robots), :2]
        truth = self.terrain.above(min(self._planes_m)).truth(spec)
        return truth, self.terrain.above(max(self._planes_m)).reachable(spec, starts) & (truth == 0)

    def travelled_m(self) -> np.ndarray:
        """[robots] m, the true distance that each has driven."""
        return self._bodies.travelled_m

    def advance(self, to_ns: int) -> None:
        """Move everything to the last base tick at or before ``to_ns``."""
        while self._next_ns <= to_ns:
            then_ns = self._next_ns
            dt_s = (then_ns - self._now_ns) / NS_PER_S
            if self._lively:
                self._move_scenery(then_ns, dt_s)
            self._contacts += self._bodies.advance(then_ns, dt_s)
            self._now_ns = then_ns
            self._tick += 1
            self._next_ns = (self._tick + 1) * self._period[0] // self._period[1]
            self._snapshot = None
            if self._lively or self._walks:
                for kind in self._odometers:
                    kind.advance(self._next_ns, self._bodies.poses)
                self._scene = self._present_scene()

    def _move_scenery(self, then_ns: int, dt_s: float) -> None:
        robots = np.column_stack([self._bodies.poses[:, :2], self._radii_m])
        closed = self._doors.lines[self._doors.closed]
        self._movers.advance(dt_s, robots, closed)
        self._crowd.advance(dt_s, np.concatenate([robots, self._movers.discs]), closed)
        self._discs = np.concatenate([self._movers.discs, self._crowd.discs])
        if self._obstacles is not None and self._obstacles.people is not None:
            self._obstacles = replace(self._obstacles, people=self._crowd.bodies)
        if self._doors.advance(then_ns, np.concatenate([robots, self._discs])):
            self._epoch += 1
            self._obstacles = None
            self._walls, self._tops_m = self._standing_walls()
        self._bodies.surround(self._walls, self._tops_m, self._discs)

    def _standing_walls(self) -> tuple[np.ndarray, np.ndarray]:
        """The lines of the terrain and of closed doors, and their heights."""
        closed, lines = self._doors.closed, self.terrain.lines
        walls = np.concatenate([lines, self._doors.lines[closed]])
        walls.setflags(write=False)
        return walls, np.concatenate([self.terrain.tops_m[:len(lines)],
                                      self._doors.height_m[closed]])

    def with_scenery(self, snapshot: Snapshot, poses: np.ndarray, closed: np.ndarray,
                     discs: np.ndarray) -> Snapshot:
        """``snapshot`` with these poses, closed doors [d] bool and moving obstacles."""
        lines = self.terrain.lines
        scene: Scene = snapshot.geometry
        return snapshot._replace(poses=poses, geometry=scene._replace(
            walls=np.concatenate([lines, self._doors.lines[closed]]), discs=discs,
            tops_m=np.concatenate([self.terrain.tops_m[:len(lines)],
                                   self._doors.height_m[closed]])))

    def command(self, robot: int, forward_mps: float, left_mps: float, turn_radps: float) -> None:
        """Set the velocity that ``robot`` shall have; its motors get it there from the next tick
        on, within the limits of its body. Raises ``ModelError`` if it is not finite."""
        if not isfinite(forward_mps + left_mps + turn_radps):
            raise ModelError(f"{self.robots[robot]}: velocity must be finite, got "
                             f"({forward_mps}, {left_mps}) m/s, {turn_radps} rad/s")
        self._bodies.command(robot, (forward_mps, left_mps, turn_radps), self._now_ns)

    def snapshot(self) -> Snapshot:
        """The state at the last tick; the same object until the next one."""
        if self._snapshot is None:
            self._snapshot = self._frozen(self._now_ns, self._bodies.poses.copy())
        return self._snapshot

    def snapshot_at(self, time_ns: int) -> Snapshot:
        """The state between two ticks: bodies go on from the last tick along their arcs at its
        velocities. (The next tick's commands are not known yet; they change a position by less than
        acceleration * tick^2, 0.7 mm for the paper's robots.)"""
        if time_ns == self._now_ns:
            return self.snapshot()
        ahead = self._bodies.ahead(time_ns - self._now_ns)
        return self._frozen(time_ns, ahead)

    def _frozen(self, time_ns: int, poses: np.ndarray) -> Snapshot:
        poses.setflags(write=False)
        return Snapshot(time_ns, poses, self._scene)

    def scan(self, snapshot: Snapshot, robots: np.ndarray, tick: int, laser: int = 0
             ) -> np.ndarray:
        """[len(robots), beams] float32 ranges in m of laser number ``laser`` of each of ``robots``,
        with noise number ``tick``; these lasers are all of one kind."""
        scene = snapshot.geometry
        return self.lidars[robots[0]][laser].scan(snapshot.poses, scene, robots, tick)

    def odometry(self, snapshot: Snapshot, robot: int, tick: int) -> np.ndarray:
        """[3] x m, y m, yaw rad as the odometer of ``robot`` shows at its tick ``tick``."""
        kind = self._odometer[robot]
        return self._odometers[kind].read(snapshot.poses, snapshot.geometry.reckoned[kind], robot,
                                          tick)

    def moving_obstacles(self) -> np.ndarray:
        """[obstacles, 3] x m, y m, radius m as of the last tick, people last."""
        return self._discs

    def contacts(self) -> list[tuple[int, int]]:
        """Collision episodes that began since the last call: (robot, other robot or -1 for wall,
        door or moving obstacle), sorted; of two robots the lower index stands first."""
        contacts, self._contacts = sorted(self._contacts), []
        return contacts

    @cached_property
    def _matter(self) -> Matter:
        return self.terrain.matter()

    def obstacles(self) -> Obstacles:
        """Walls, closed doors and people. The epoch grows when a door moves."""
        if self._obstacles is None:
            doors, fixed = self._doors, self._matter
            moving = (doors.lines, doors.material, doors.thickness_m, doors.height_m,
                      np.zeros(len(doors.lines), bool))
            columns = [np.concatenate([still, door[doors.closed]])
                       for still, door in zip(fixed[:5], moving, strict=True)]
            for column in columns:
                column.setflags(write=False)
            segments, material, thickness_m, height_m, block = columns
            self._obstacles = Obstacles(segments, material, thickness_m, height_m, materials.NAMES,
                                        self._epoch, fixed.crossing, block,
                                        toll if fixed.crossing is crossing else None,
                                        self._crowd.bodies)
        return self._obstacles

    def _arena(self, specs: list[RobotSpec], tick_s: float) -> ports.Arena:
        """The start of bodies of another simulator."""
        led = [spec.name for spec in specs if spec.path is not None]
        if led:
            raise InputError(f"physics.model: {led[0]} moves as a recording says, which bodies of "
                             "another simulator cannot; allowed: plane")
        return ports.Arena(self.robots, tuple(self._types), np.array(
            [(spec.x_m, spec.y_m, spec.yaw_rad) for spec in specs]).reshape(-1, 3),
            self.obstacles(), tick_s)

    @classmethod
    def build(cls, scenario: Scenario, streams: RandomStreams, bodies: ports.Bodies | None = None
              ) -> Plane:
        """The plane of a scenario whose paths are absolute, as loading leaves them; ``bodies``:
        those of another simulator."""
        return cls(scenario.environment, place_fleet(scenario), scenario.physics.rate_hz, streams,
                   bodies)
