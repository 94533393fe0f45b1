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


def marks(medium: Medium, mark: Mark | None) -> Callable[[Frame], int] | None:
    """``ports.Context.dscp`` of a medium where carriers' frames have this ``mark``."""
    if mark is None:
        return None

    def of(frame: Frame) -> int:
        found = medium.carried(frame)
        return 0 if found is None else mark(*found)

    return of
