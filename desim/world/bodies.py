"""The bodies of the fleet, moved together by one kernel call."""

from __future__ import annotations

import numpy as np

from desim.compiler.kernel import compiled_function
from desim.errors import InputError
from desim.units import NS_PER_S
from desim.world.fleet import RobotSpec
from desim.world.kernels import bodies as kernels
from desim.world.kernels import outlined_bodies
from desim.world.kernels.bodies import BodyArrays
from desim.world.kernels.contact import Barriers
from desim.world.outlines import Outlines
from desim.world.terrain import Raster, Terrain
from desim.world.wall_index import tile_index

TILE_M = 2.0  # smaller tiles list fewer walls and cost memory
_NEVER_NS = -(1 << 62)


class PlaneBodies:
    """Poses and velocities of robots, in the order of ``specs``.

    ``poses`` [n, 3] x m, y m, yaw rad; ``velocities`` [n, 3] forward, left m/s, turn rad/s;
    ``radii_m`` [n], of polygons the circumscribed one; ``outlines``; ``travelled_m`` [n] the
    distance that each has driven.
    """

    def __init__(self, specs: list[RobotSpec], terrain: Terrain, tick_s: float) -> None:
        n = len(specs)
        for spec in specs:
            body = spec.body
            # A corner of a polygon goes round, too; the rim of a disc stays what it is.
            round_mps = body.max_turn_radps * body.radius_m if body.footprint else 0.0
            fastest_mps, most_m = body.max_speed_mps + round_mps, body.inscribed_radius_m / 2.0
            if fastest_mps * tick_s > most_m:
                who, least = (f"a corner of {spec.name}", "inscribed radius") if body.footprint \
                    else (spec.name, "radius")
                raise InputError(
                    f"physics.rate: at {fastest_mps:g} m/s {who} covers {fastest_mps * tick_s:g} m "
                    f"in a tick and could pass through walls; allowed: half its {least} "
                    f"({most_m:g} m)")
            if terrain.raster is not None and (terrain.tops_m <= body.passes_m).any():
                raise InputError(f"environment.terrain.height: {spec.name} would get over all "
                                 f"that the map shows; allowed: more than its clearance or "
                                 f"altitude, {body.passes_m:g} m")
        self.poses = np.array([(s.x_m, s.y_m, s.yaw_rad) for s in specs],
                              dtype=np.float64).reshape(-1, 3)
        self.poses[:, 2] -= 2.0 * np.pi * np.floor((self.poses[:, 2] + np.pi) / (2.0 * np.pi))
        self.velocities = np.zeros((n, 3))
        self.travelled_m = np.zeros(n)
        self.radii_m = np.array([spec.body.radius_m for spec in specs])
        limits = np.array([(b.radius_m, b.max_speed_mps, b.max_turn_radps, b.acceleration_mps2,
                            b.turn_acceleration_radps2, float(b.drive != "differential"),
                            b.passes_m, b.altitude_m, spec.top_m)
                           for spec, b in ((spec, spec.body) for spec in specs)],
                          dtype=np.float64).reshape(n, 9)
        clocks = np.full((n, 3), _NEVER_NS, dtype=np.int64)
        clocks[:, kernels.TIMEOUT] = [spec.body.command_timeout_ns for spec in specs]
        pairs = n * (n - 1) // 2
        self._arrays = BodyArrays(
            self.poses, self.velocities, np.zeros((n, 3)), limits, clocks, np.zeros((n, 4)),
            self.travelled_m, np.full((n, n), _NEVER_NS, dtype=np.int64),
            episodes=np.zeros((n + pairs, 2), dtype=np.int64), order=np.arange(n),
            pairs=np.zeros((pairs + 1, 2), dtype=np.int64))
        # Written to in a third of numpy's time.
        self._commands: memoryview[float] = self._arrays.commands.data  # type: ignore[assignment]
        self._clocks = self._arrays.clocks.data
        widest = float(self.radii_m.max(initial=0.0))
        self.outlines = Outlines([spec.body for spec in specs])
        # Discs alone have a kernel of their own, which is faster.
        self._shapes = () if self.outlines.is_disc.all() else (self.outlines.at(self.poses),)
        self._advance = compiled_function((outlined_bodies if self._shapes else kernels).advance)
        self._barriers = Barriers(
            terrain.lines, terrain.tops_m[:len(terrain.lines)], len(terrain.lines),
            tile_index(terrain.lines, terrain.bounds, TILE_M, widest + kernels.NEAR_M),
            *_field(terrain.raster), discs=np.zeros((0, 3)))

    def surround(self, walls: np.ndarray, tops_m: np.ndarray, discs: np.ndarray) -> None:
        """Set what bodies run into from now on: ``walls`` [n, 4] m (the terrain's, then closed
        doors') of these heights [n], and ``discs`` [d, 3] x, y, radius m."""
        self._barriers = self._barriers._replace(walls=walls, tops=tops_m, discs=discs)

    def command(self, robot: int, velocity: tuple[float, float, float], now_ns: int) -> None:
        """Set the velocity that ``robot`` shall have from the next tick on: forward, left m/s, turn
        rad/s."""
        commands = self._commands
        commands[robot, 0], commands[robot, 1], commands[robot, 2] = velocity
        self._clocks[robot, kernels.COMMANDED] = now_ns

    def ahead(self, after_ns: int) -> np.ndarray:
        """[n, 3] the poses after ``after_ns`` more at the present velocities."""
        poses = self.poses.copy()
        kernels.move_all(poses, self.velocities, after_ns / NS_PER_S)
        return poses

    def advance(self, now_ns: int, dt_s: float) -> list[tuple[int, int]]:
        """Make one tick that ends at ``now_ns``. Returns the contact episodes that began: (robot,
        other or -1)."""
        began = self._advance(self._arrays, self._barriers, now_ns, dt_s, *self._shapes)
        return [tuple(row) for row in self._arrays.episodes[:began].tolist()] if began else []


def _field(raster: Raster | None) -> tuple[np.ndarray, np.ndarray]:
    """The distance to the nearest solid cell, [rows, cols] uint8 chessboard distance in cells, at
    most 255, and the frame: x0 m, y0 m, cells per m. No raster: no cells."""
    if raster is None:
        return np.zeros((0, 0), dtype=np.uint8), np.array([0.0, 0.0, 1.0])
    from scipy.ndimage import distance_transform_cdt  # 0.06 s, which most runs do not need

    near = distance_transform_cdt(~raster.solid, metric="chessboard").clip(0, 255)
    return (np.ascontiguousarray(near, dtype=np.uint8),
            np.array([raster.x_m, raster.y_m, 1.0 / raster.resolution_m]))
