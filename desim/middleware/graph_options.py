"""The choices of a run for its graph, beside hosts and middleware."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from desim.computers.computer import Computer
from desim.errors import InputError
from desim.middleware.fates import OnFate
from desim.scenario.schema.sockets import Sockets

if TYPE_CHECKING:
    from desim.middleware.busy.timed_executor import PublishingCallback
    from desim.network.passages import Passages

_PAYLOADS = "lazy", "birth", "delivery"


@dataclass(frozen=True, slots=True)
class GraphOptions:
    """The choices of a run for its graph.

    ``others``: how many hosts outside of the fleet its media have, with the indices after.
    ``payloads`` says when a lazy content is read: ``lazy`` (by the callback that wants it),
    ``birth`` or ``delivery``; no result depends on it. ``on_fate`` that ``TakesDeliveries`` gets
    them in its way. Where there is a ledger, ``passages`` are those of its media, and ``callbacks``
    gets the callbacks that publish, if computers get busy. ``computers``: those of all hosts by
    name; None: callbacks take no time. ``sockets``: the buffers of each host's UDP sockets, those
    of Linux by default. Raises ``InputError`` for other ``payloads``."""

    others: int = 0
    payloads: str = "lazy"
    on_fate: OnFate | None = None
    passages: Passages | None = None
    callbacks: list[PublishingCallback] | None = None
    computers: Mapping[str, Computer] | None = None
    sockets: Sockets = field(default_factory=Sockets)

    def __post_init__(self) -> None:
        if self.payloads not in _PAYLOADS:
            raise InputError("payloads are read lazy, at birth or at delivery, not "
                             f"{self.payloads!r}")


PLAIN = GraphOptions()
