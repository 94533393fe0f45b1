"""The marks of packets (DSCP), by which a radio chooses their access category."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from desim.network.carrier import AnyCarrier
from desim.ports import Frame

if TYPE_CHECKING:
    from desim.network.medium import Medium

# Called with a frame's carrier and token: its mark, 0 to 63.
Mark = Callable[[AnyCarrier, object], int]


def carried(medium: Medium, frame: Frame) -> tuple[AnyCarrier, object] | None:
    """The carrier and the token of an open frame; None of a frame of the model's own."""
    number = frame.id
    if number in medium._broadcasts:
        broadcast = medium._broadcasts[number]
        return broadcast.carrier, broadcast.token
    claim = medium._open.get(number)
    return None if claim is None else claim[:2]


def marks(medium: Medium, mark: Mark | None) -> Callable[[Frame], int] | None:
    """``ports.Context.dscp`` of a medium where carriers' frames have this ``mark``."""
    if mark is None:
        return None
    given = mark

    def of(frame: Frame) -> int:
        found = carried(medium, frame)
        return 0 if found is None else given(*found)

    return of
