"""A tap on a medium, which counts what each host sends."""

from __future__ import annotations

from typing import ClassVar

from pydantic import Field

from desim import ports
from desim.middleware.headers import SEGMENT_HEADER_BYTES
from desim.units import Duration
from desim.validation.real.cell import SentFrames


class WireTapParams(ports.Params):
    """The parameters of the tap."""

    since_ns: Duration = Field("0 s", description="from when on it counts")


class WireTap:
    """A rule that lets all pass, and counts it by host as it goes onto the medium."""

    Params = WireTapParams
    reasons: ClassVar[tuple[str, ...]] = ()

    def __init__(self, params: WireTapParams) -> None:
        self._since_ns = params.since_ns
        self._sent: dict[int, SentFrames] = {}

    def start(self, context: ports.RuleContext, hosts: tuple[str, ...]) -> None:
        self._context, self._hosts = context, hosts

    def judge(self, frame: ports.Frame, receivers: tuple[int, ...]) -> None:
        if self._context.now_ns >= self._since_ns:
            self._sent[frame.source] = more(self._sent.get(frame.source, SentFrames()),
                                            frame.segments, frame.size_bytes)

    @property
    def sent(self) -> dict[str, SentFrames]:
        """The counts by host."""
        return {self._hosts[host]: count for host, count in self._sent.items()}


def more(sent: SentFrames, frames: int, size_bytes: int) -> SentFrames:
    """``sent`` with ``frames`` of together ``size_bytes``."""
    return SentFrames(sent.frames + frames, sent.size_bytes + size_bytes,
                sent.payload_bytes + max(size_bytes - frames * SEGMENT_HEADER_BYTES, 0))
