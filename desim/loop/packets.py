"""Real frames by their headers: protocol, port, and size on a medium."""

from __future__ import annotations

_TYPES = {0x0806: "arp", 0x86DD: "ipv6"}  # IANA, EtherTypes
_PROTOCOLS = {1: "icmp", 2: "igmp", 6: "tcp", 17: "udp"}  # IANA, protocol numbers
_ETHERNET_BYTES = 14
MIN_FRAME_BYTES, CHECK_BYTES = 60, 4  # IEEE 802.3, 3.2.7 to 3.2.9
_EPHEMERAL = 32_768  # Linux takes the ports of clients from here (ip_local_port_range)


def topic_of(frame: bytes) -> str:
    """The topic under which desim counts a frame: protocol and port, as /tcp/11311. Of two ports it
    is the lower one, which is the server's as a rule; two ports of clients have none."""
    kind = int.from_bytes(frame[12:14], "big")
    if kind != 0x0800 or len(frame) < _ETHERNET_BYTES + 20:
        return f"/{_TYPES.get(kind, f'ethertype_{kind:04x}')}"
    protocol = _PROTOCOLS.get(frame[23], f"ip_{frame[23]}")
    first = _ETHERNET_BYTES + 4 * (frame[14] & 15)
    fragment = int.from_bytes(frame[20:22], "big") & 0x1FFF
    if protocol not in ("tcp", "udp") or fragment or len(frame) < first + 4:
        return f"/{protocol}"
    port = min(int.from_bytes(frame[first:first + 2], "big"),
               int.from_bytes(frame[first + 2:first + 4], "big"))
    return f"/{protocol}/{port if port < _EPHEMERAL else 'dynamic'}"


def protocol_of(topic: str) -> str:
    """The protocol of a topic of ``topic_of``, as ``Carrier.protocol`` has it."""
    name = topic.split("/")[1]
    return name if name in ("tcp", "arp") else "udp"


def size_on_wire(frame: bytes) -> int:
    """The bytes of a frame on a medium: with its check sequence, and padding if it is short."""
    return max(len(frame), MIN_FRAME_BYTES) + CHECK_BYTES


