"""A robot of desim as programs see it: its lasers, odometry and motors as topics of ROS 1 or ROS 2.

The node speaks to a bridge, a program in the network namespace of the robot, by lines: to it topics
and messages in JSON (``facade_messages.py``), from it a topic and numbers (``cmd_vel 0.5 0 0.1``).
"""

from __future__ import annotations

import json
import os
import subprocess
from collections.abc import Mapping, Sequence
from fractions import Fraction
from functools import partial
from pathlib import Path

from desim.engine.kernel import Phase
from desim.loop import facade_messages as messages
from desim.loop.bridges import Bridge
from desim.loop.clock import ProgramClock
from desim.loop.outside_strategy import OutsideStrategy
from desim.loop.program_input import ProgramInput
from desim.loop.programs import ProgramEnd, namespace_command, terminate
from desim.middleware.contents import Goal, LaserScan, Pose, Twist
from desim.middleware.host import Host
from desim.middleware.message import Message
from desim.middleware.node import Node

_MAPS_HZ = Fraction(1, 5)  # at most: slam_gmapping's map_update_interval is 5 s
_MOST_BYTES = 1 << 16


class Facade(Node):
    """The topics of a robot by one ``bridge``: what its lasers (``lasers``: their topics) and
    odometer publish goes out, cmd_vel comes in. With a ``strategy`` its map goes out, too, and
    goals come in; ``refused_goals`` counts those of no use, by why. ``clock`` stamps messages;
    ``logs`` gets what the bridge says."""

    def __init__(self, host: Host, bridge: Bridge, lasers: Sequence[str], env: Mapping[str, str],
                 logs: Path, inputs: ProgramInput, clock: ProgramClock,
                 strategy: OutsideStrategy | None) -> None:
        super().__init__(host, bridge.name)
        self._bridge, self._lasers, self._env = bridge, lasers, env
        self._log = logs / bridge.log(host.name)
        self._inputs, self._clock, self._strategy = inputs, clock, strategy
        self._process: subprocess.Popen[bytes] | None = None
        self._ends: list[ProgramEnd] = []
        self._rest = b""  # of a line
        self._odometry: Pose | None = None  # the newest
        self.refused_goals: dict[str, int] = {}

    def start(self) -> None:
        self.advertise("cmd_vel")
        for laser in self._lasers:
            self.subscribe(laser, partial(self._on_scan, laser))
        self.subscribe("odom", self._on_odometry)
        if self._strategy is not None:
            self.advertise("goal")
            self.subscribe("pose", self._on_pose)
            self.timer(_MAPS_HZ, self._show_map, name="map")
        with self._log.open("ab") as log:
            self._process = subprocess.Popen(
                namespace_command(self.host.name, self._bridge.command(self.host.name)),
                env=dict(self._env), stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=log,
                start_new_session=True)
        assert self._process.stdout is not None
        os.set_blocking(self._process.stdout.fileno(), False)
        self._inputs.watch(self._process.stdout.fileno(), self._take)

    def stop(self) -> None:
        super().stop()
        self.end()

    def end(self) -> list[ProgramEnd]:
        """End the bridge. Returns how it ended, if that was not by this."""
        process, self._process = self._process, None
        if process is None or process.stdout is None:
            return self._ends
        self._inputs.forget(process.stdout.fileno())
        if code := process.poll():
            self._ends.append(ProgramEnd(self.host.name, self._bridge.name, self._log.name, code))
        terminate([process])
        return self._ends

    # ------------------------------------------------------------------------- what programs get

    def _on_scan(self, topic: str, message: Message) -> None:
        scan: LaserScan = message.content
        stamp = self._time(scan.stamp_ns)
        self._write((topic, messages.laser_scan(self.namespace, topic, scan, stamp)),
                    ("tf", messages.laser_transform(self.namespace, topic, scan, stamp)))

    def _on_odometry(self, message: Message) -> None:
        pose: Pose = message.content
        self._odometry, stamp = pose, self._time(pose.stamp_ns)
        self._write(("odom", messages.odometry(self.namespace, pose, stamp)),
                    ("tf", messages.odometry_transform(self.namespace, pose, stamp)))

    def _on_pose(self, message: Message) -> None:
        pose, odometry = message.content, self._odometry
        if odometry is not None and odometry.stamp_ns == pose.stamp_ns:
            self._write(("tf", messages.map_transform(
                self.namespace, pose, odometry, self._time(pose.stamp_ns))))

    def _show_map(self, _: int) -> None:
        if self._strategy is not None and (grid := self._strategy.new_map()) is not None:
            self._write(("map", messages.occupancy_grid(*grid, self._time(self.now_ns))))

    def _time(self, stamp_ns: int) -> int:
        return self._clock.unix_ns(stamp_ns)

    def _write(self, *said: tuple[str, messages.Fields]) -> None:
        """Send the bridge a line: topics and messages. A bridge that has ended gets none."""
        if self._process is None or self._process.stdin is None:
            return
        try:
            self._process.stdin.write(json.dumps(said).encode() + b"\n")
            self._process.stdin.flush()
        except BrokenPipeError:
            self._process.wait()
            self.end()

    # -------------------------------------------------------------------------- what they want

    def _take(self, now_ns: int) -> None:
        """Read the lines of the bridge: topics and numbers."""
        assert self._process is not None and self._process.stdout is not None
        read = os.read(self._process.stdout.fileno(), _MOST_BYTES)
        if not read:
            self._inputs.forget(self._process.stdout.fileno())
            return
        *lines, self._rest = (self._rest + read).split(b"\n")
        for line in lines:
            topic, *numbers = line.decode().split()
            self._graph.kernel.at(now_ns, Phase.CONTROL, self.host.id, self._do,
                                  (topic, tuple(map(float, numbers))))

    def _do(self, wanted: tuple[str, tuple[float, ...]]) -> None:
        topic, numbers = wanted
        if not self._alive:
            return
        if topic == "cmd_vel":
            self.publish(topic, Twist(*numbers))
        else:
            self._go(*numbers)

    def _go(self, x_m: float, y_m: float) -> None:
        if self._strategy is None:
            self._refuse_goal(x_m, y_m, "loop.navigation is false")
        elif self._strategy.is_on_map(x_m, y_m):
            self.publish("goal", Goal(x_m, y_m))
        else:
            self._refuse_goal(x_m, y_m, "not on the map")

    def _refuse_goal(self, x_m: float, y_m: float, why: str) -> None:
        self.refused_goals[why] = self.refused_goals.get(why, 0) + 1
        with self._log.open("a", encoding="utf-8") as log:
            log.write(f"no goal {x_m:g} {y_m:g}: {why}\n")
