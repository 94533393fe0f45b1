"""What do laser and physics cost? Workload W: a fleet that only senses and wanders.

N robots in the paper's 80 m maze, laser 180 beams over 190 degrees, 26 m, 25 Hz, odometry 10 Hz,
physics 60 Hz, no noise, other robots visible and collidable. Each robot steers by its own scan.
"""

from __future__ import annotations

import time
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

from desim.engine.kernel import Kernel, Phase
from desim.engine.streams import Streams
from desim.scenario.schema.scenario import Scenario
from desim.world.plane import Plane

CRUISE_MPS, TURN_RADPS = 1.0, 1.5
TURN_BACK_M, CLOSE_M = 1.5, 0.6  # turn before what is nearer, stop before what is close
AHEAD = slice(62, 119, 4)  # beams within 30 degrees
CELLS, CELL_M = 10, 8.0


def scenario(robots: int, terrain: Any) -> Scenario:
    """Robots spread over the maze's 100 cells, at most one in each, looking in four directions."""
    poses = []
    for i in range(robots):
        row, col = divmod(i * CELLS * CELLS // robots, CELLS)
        poses.append({"x": f"{(col + 0.5 - CELLS / 2) * CELL_M} m",
                      "y": f"{(row + 0.5 - CELLS / 2) * CELL_M} m",
                      "heading": f"{90 * (i % 4)} deg"})
    return Scenario.model_validate({
        "name": "w", "environment": {"terrain": terrain},
        "fleet": {"size": robots, "start": {"poses": poses, "snap": True}},
        "robot": {"odometry": {"position_noise": "0 m", "heading_noise": "0 rad"}}})


def raster_maze(folder: Path) -> dict[str, str]:
    """The maze as a map_server image at 0.2 m per cell, written into ``folder``."""
    terrain = build(1, "maze").terrain
    grid = terrain.grid(0.2)
    solid = terrain.truth(grid)
    Image.fromarray(np.where(solid[::-1], 0, 254).astype(np.uint8)).save(folder / "maze.pgm")
    (folder / "maze.yaml").write_text(
        f"image: maze.pgm\nresolution: {grid.resolution_m}\n"
        f"origin: [{grid.x_m}, {grid.y_m}, 0.0]\n"
        "negate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n")
    return {"map": str(folder / "maze.yaml")}


def build(robots: int, terrain: Any) -> Plane:
    """The world of W."""
    return Plane.build(scenario(robots, terrain), Streams(1))


class Wander:
    """The fleet on the kernel's clock: 60 Hz ticks, 25 Hz scans that steer, 10 Hz odometry."""

    def __init__(self, world: Plane) -> None:
        self.kernel, self.world = Kernel(), world
        self.all = np.arange(len(world.robots))
        self.readings = 0
        for hertz, phase, tick in ((60, Phase.WORLD, self._advance), (25, Phase.SENSE, self._scan),
                                   (10, Phase.SENSE, self._odometry)):
            self.kernel.ticker(Fraction(hertz), phase, 0, tick)

    def _advance(self, tick: int) -> None:
        self.world.advance(self.kernel.now_ns)

    def _scan(self, tick: int) -> None:
        world = self.world
        ranges = world.scan(world.snapshot(), self.all, tick)
        ahead = ranges[:, AHEAD].min(axis=1).tolist()
        for robot, distance_m in enumerate(ahead):
            if distance_m > TURN_BACK_M:
                world.command(robot, CRUISE_MPS, 0.0, 0.0)
            else:
                world.command(robot, max(distance_m - CLOSE_M, 0.0), 0.0, TURN_RADPS)

    def _odometry(self, tick: int) -> None:
        snapshot = self.world.snapshot()
        for robot in range(len(self.all)):
            self.world.odometry(snapshot, robot, tick)
            self.readings += 1

    def seconds(self, simulated_s: int) -> float:
        """CPU seconds for ``simulated_s`` more seconds."""
        start = time.process_time()
        self.kernel.run(self.kernel.now_ns + simulated_s * 10**9)
        return time.process_time() - start
