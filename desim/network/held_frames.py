"""Frames that wait in front of a network model, in the queue of a rule."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from heapq import heappop, heappush
from typing import TYPE_CHECKING, NamedTuple

from desim.engine.kernel import Kernel, Phase
from desim.network.terms import Claim
from desim.ports import Frame

if TYPE_CHECKING:
    from desim.network.medium import Medium


class HeldFrame(NamedTuple):
    """A frame, of each receiver the claim, and the call that hands it to the model."""

    due_ns: int
    frame: Frame
    claims: Sequence[Claim]
    send: Callable[[], object]


class HeldFrames:
    """The frames that wait in front of the model of ``medium``; ``count``: at how many receivers
    they are due. Of frames that are due at once, the earlier one goes first."""

    __slots__ = ("count", "_medium", "_kernel", "_frames")

    def __init__(self, medium: Medium, kernel: Kernel) -> None:
        self._medium, self._kernel = medium, kernel
        self._frames: list[HeldFrame] = []  # a heap
        self.count = 0

    def hold(self, wait_ns: int, frame: Frame, claims: Sequence[Claim], send: Callable[[], object]
             ) -> None:
        """Call ``send`` after ``wait_ns``, unless the frame's source has stopped by then."""
        medium = self._medium
        self.count += len(claims)
        heappush(self._frames, HeldFrame(medium.now_ns + wait_ns, frame, claims, send))
        self._kernel.after(wait_ns, Phase.NETWORK, medium.id, self.release)

    def holds(self, number: int) -> bool:
        """Whether frame ``number`` waits."""
        return bool(self.count) and any(held.frame.id == number for held in self._frames)

    def release(self, _: object = None) -> None:
        """Hand over what is due. The medium calls it, too, before it takes a frame: none overtakes
        what is due in its own instant."""
        medium, frames = self._medium, self._frames
        while frames and frames[0].due_ns <= medium.now_ns:
            _, frame, claims, send = heappop(frames)
            self.count -= len(claims)
            if medium.flights.up[frame.source]:
                judged, medium.on_refusal = medium.on_refusal, []  # they have judged others since
                send()
                medium.on_refusal = judged
            else:
                self._lose(claims)
            if medium.departures.held and not medium.is_open(frame.id):
                medium.left(frame)

    def _lose(self, claims: Sequence[Claim]) -> None:
        for carrier, token, receiver, _, segments, terms in claims:
            self._medium.count_drops("sender_down", 1, segments - len(terms.lost))
            carrier.lost(token, receiver, "sender_down")
