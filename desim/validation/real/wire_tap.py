"""A tap on a medium, which counts what each host sends."""

from __future__ import annotations

from typing import ClassVar

from desim import ports
from desim.middleware.transports import SEGMENT_HEADER_BYTES
from desim.validation.real.cell import SentFrames


class WireTap:
    """A rule that lets all pass, and counts it by host as it goes onto the medium."""

    Params = ports.Params
    reasons: ClassVar[tuple[str, ...]] = ()

    def __init__(self, params: ports.Params) -> None:
        self._sent: dict[int, SentFrames] = {}

    def start(self, context: ports.RuleContext, hosts: tuple[str, ...]) -> None:
        self._hosts = hosts

    def judge(self, frame: ports.Frame, receivers: tuple[int, ...]) -> None:
        self._sent[frame.source] = more(self._sent.get(frame.source, SentFrames()), frame.segments,
                                        frame.size_bytes)

    @property
    def sent(self) -> dict[str, SentFrames]:
        """The counts by host."""
        return {self._hosts[host]: count for host, count in self._sent.items()}


def more(sent: SentFrames, frames: int, size_bytes: int) -> SentFrames:
    """``sent`` with ``frames`` of together ``size_bytes``."""
    return SentFrames(sent.frames + frames, sent.size_bytes + size_bytes,
                sent.payload_bytes + max(size_bytes - frames * SEGMENT_HEADER_BYTES, 0))
