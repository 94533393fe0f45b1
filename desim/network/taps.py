"""Taps, for those who watch what a medium carries."""

from __future__ import annotations

from collections.abc import Callable
from typing import Never

from desim.network.carrier import Carrier
from desim.network.medium import Medium, none_of
from desim.ports import Frame


def tap(medium: Medium, notice: Callable[[Frame, Carrier[Never], object], object]) -> None:
    """Call ``notice(frame, carrier, token)`` for each frame that rules let through to at least one
    receiver, before the model takes it. No fate depends on it."""
    send = medium._send

    def tapped(frame: Frame) -> int | None:
        if found := medium.carried(frame):
            notice(frame, *found)
        return send(frame)

    medium._send, medium._send_many = tapped, none_of
