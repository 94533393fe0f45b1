"""The buffers of UDP sockets."""

from __future__ import annotations

from pydantic import Field

from desim.ports import Params
from desim.units import ByteSize, Duration


class Sockets(Params):
    """The buffers of each host's UDP sockets, in the memory that Linux accounts for: 2304 B for a
    full packet, 768 B for one of 100 B."""

    send_buffer_bytes: ByteSize = Field("212992 B", ge=4608, description=(
        "of a sender; while it is full, publishers wait (Linux: net.core.wmem_default)"))
    receive_buffer_bytes: ByteSize = Field("212992 B", ge=2304, description=(
        "of a receiver; while it is full, datagrams are lost (Linux: net.core.rmem_default)"))
    read_ns: Duration = Field("0 ns", description=(
        "that the thread which reads a socket takes for a datagram (none: it is read at once)"))
    reassembly_bytes: ByteSize = Field("4 MiB", description=(
        "of a host, for fragments of incomplete datagrams; above it no other begins (Linux: "
        "net.ipv4.ipfrag_high_thresh)"))
    reassembly_time_ns: Duration = Field("30 s", description=(
        "for which these are kept (Linux: net.ipv4.ipfrag_time)"))
