"""The critic Oscillation of Nav2's DWB: a velocity whose sign has changed may not change back."""

from __future__ import annotations

import math

Position = tuple[float, float, float]  # x m, y m, yaw rad


class _Trend:
    """The sign of one component of the last commands, and the one that is forbidden: 0, 1 or -1."""

    def __init__(self) -> None:
        self.sign = self.forbidden = 0

    def note(self, velocity: float) -> bool:
        """Note a command; True if its sign is another."""
        sign = (velocity > 0.0) - (velocity < 0.0)
        flipped = sign * self.sign < 0
        if flipped:
            self.forbidden = -sign
        self.sign = sign or self.sign
        return flipped


class Oscillation:
    """Remembers the commands since the robot last moved ``reset_m`` or turned ``reset_rad`` from
    the pose of the last change of sign. Turns count where it drives at ``x_only_mps`` or less."""

    def __init__(self, reset_m: float, reset_rad: float, x_only_mps: float) -> None:
        self._reset_m, self._reset_rad, self._x_only_mps = reset_m, reset_rad, x_only_mps
        self._since: Position = 0.0, 0.0, 0.0
        self.reset()

    def reset(self) -> None:
        """Forget all."""
        self._drive, self._turn = _Trend(), _Trend()

    @property
    def forbidden(self) -> tuple[bool, bool, bool, bool]:
        """Whether forward, backward, left and right are not allowed now."""
        drive, turn = self._drive.forbidden, self._turn.forbidden
        return drive > 0, drive < 0, turn > 0, turn < 0

    def note(self, position: Position, speed_mps: float, turn_radps: float) -> None:
        """Note the command that is given at ``position``."""
        flipped = self._drive.note(speed_mps)
        if abs(speed_mps) <= self._x_only_mps:
            flipped |= self._turn.note(turn_radps)
        if flipped:
            self._since = position
        if any(self.forbidden):
            x_m, y_m, yaw_rad = self._since
            turned_rad = math.remainder(position[2] - yaw_rad, math.tau)
            if (math.dist(position[:2], (x_m, y_m)) > self._reset_m
                    or abs(turned_rad) > self._reset_rad):
                self.reset()
