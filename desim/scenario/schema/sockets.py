"""The buffers of UDP sockets."""

from __future__ import annotations

from pydantic import Field

from desim.ports import Params
from desim.units import ByteSize


class Sockets(Params):
    """The buffers of each host's UDP sockets, in the memory that Linux accounts for: 2304 B for a
    full packet, 768 B for one of 100 B."""

    send_buffer_bytes: ByteSize = Field("212992 B", ge=4608, description=(
        "of a sender; while it is full, publishers wait (Linux: net.core.wmem_default)"))
