"""The parameters of TCP, and how bytes become segments."""

from __future__ import annotations

from collections.abc import Collection
from itertools import pairwise
from typing import Literal

from pydantic import Field

from desim import ports
from desim.middleware.tcp.constants import TcpConstants


class TcpParams(ports.Params):
    """Parameters of all TCP connections of a run."""

    acks: Literal["sent", "implied"] = Field("sent", description=(
        "sent: acknowledgements are frames; implied: a sender knows at once what has arrived, "
        "without a frame, for long studies on networks that have room (sent: TCP)"))
    arp: Literal["natural", "static"] = Field("natural", description=(
        "natural: a host asks for the other's address, and again when it has not heard of it for "
        "long, and a retransmission that finds none takes one doubling of the timeout back (RFC "
        "6069), as on any LAN; static: addresses are known for good, as where the hosts are "
        "not on one subnet"))
    constants: TcpConstants = Field(default_factory=TcpConstants, description="(those of Linux)")


def runs(segments: int, lost: Collection[int]) -> list[tuple[int, int]]:
    """The runs of segments of a train that are not ``lost``: number of the first one, and of the
    first one behind the run."""
    gaps = [-1, *sorted(lost), segments]
    return [(gap + 1, after) for gap, after in pairwise(gaps) if after > gap + 1]
