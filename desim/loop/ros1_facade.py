"""A robot of desim as ROS 1 nodes see it: its lasers, odometry and motors as topics of ROS.

The node speaks to ``ros1_bridge.py``, a program of rospy in the network namespace of the robot, by
lines of JSON.
"""

from __future__ import annotations

import json
import os
import subprocess
from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path

from desim.engine.kernel import Phase
from desim.loop.program_input import ProgramInput
from desim.loop.programs import namespace_command, terminate
from desim.middleware.contents import Twist
from desim.middleware.host import Host
from desim.middleware.message import Message
from desim.middleware.node import Node

PYTHON = "/usr/bin/python3"  # which has rospy on Debian and Ubuntu
_BRIDGE = Path(__file__).with_name("ros1_bridge.py")
_MOST_BYTES = 1 << 16


class Ros1Facade(Node):
    """The topics of a robot: what its lasers (``lasers``: their topics) and odometer publish goes
    to ROS 1, and cmd_vel comes from there."""

    def __init__(self, host: Host, lasers: Sequence[str], env: Mapping[str, str], logs: Path,
                 inputs: ProgramInput) -> None:
        super().__init__(host, "ros1_facade")
        self._lasers, self._env, self._inputs = lasers, env, inputs
        self._log = logs / f"{host.name}.ros1_bridge.log"
        self._log.unlink(missing_ok=True)
        self._bridge: subprocess.Popen[bytes] | None = None
        self._rest = b""

    def start(self) -> None:
        self._alive = True
        self.advertise("cmd_vel")
        for laser in self._lasers:
            self.subscribe(laser, partial(self._scan, laser))
        self.subscribe("odom", self._odometry)
        with self._log.open("ab") as log:
            self._bridge = subprocess.Popen(
                namespace_command(self.host.name, [PYTHON, str(_BRIDGE), self.host.name]),
                env=dict(self._env), stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=log,
                start_new_session=True)
        assert self._bridge.stdout is not None
        os.set_blocking(self._bridge.stdout.fileno(), False)
        self._inputs.watch(self._bridge.stdout.fileno(), self._take)

    def stop(self) -> None:
        super().stop()
        self.end()

    def end(self) -> None:
        """End the bridge."""
        if self._bridge is not None and self._bridge.stdout is not None:
            self._inputs.forget(self._bridge.stdout.fileno())
            terminate([self._bridge])
        self._bridge = None

    def _scan(self, topic: str, message: Message) -> None:
        scan = message.content
        self._write({"scan": topic, "stamp_ns": scan.stamp_ns, "ranges": scan.ranges.tolist(),
                    "angle_min": scan.angle_min_rad, "increment": scan.angle_increment_rad,
                    "range_max": scan.range_max_m, "at": [scan.x_m, scan.y_m]})

    def _odometry(self, message: Message) -> None:
        pose = message.content
        self._write({"odom": [pose.x_m, pose.y_m, pose.yaw_rad], "stamp_ns": pose.stamp_ns})

    def _write(self, what: dict[str, object]) -> None:
        """Send the bridge a line; a bridge that has ended gets none."""
        if self._bridge is None or self._bridge.stdin is None:
            return
        try:
            self._bridge.stdin.write(json.dumps(what).encode() + b"\n")
            self._bridge.stdin.flush()
        except BrokenPipeError:
            self.end()

    def _take(self, now_ns: int) -> None:
        """Read velocities: lines of forward, left and turn."""
        assert self._bridge is not None and self._bridge.stdout is not None
        read = os.read(self._bridge.stdout.fileno(), _MOST_BYTES)
        if not read:
            self._inputs.forget(self._bridge.stdout.fileno())
            return
        *lines, self._rest = (self._rest + read).split(b"\n")
        for line in lines:
            self._graph.kernel.at(now_ns, Phase.CONTROL, self.host.id, self._command,
                                  Twist(*map(float, line.split())))

    def _command(self, velocity: Twist) -> None:
        if self._alive:
            self.publish("cmd_vel", velocity)
