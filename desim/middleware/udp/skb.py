"""The memory that a packet takes in Linux: that of its ``sk_buff``, which sockets account for."""

from __future__ import annotations

from functools import lru_cache

from desim.middleware.headers import ETHERNET_BYTES
from desim.ports import packet_sizes

ROOM_BYTES = 31  # for the header: LL_RESERVED_SPACE of Ethernet and 15 (ip_output.c)
INFO_BYTES = 320  # struct skb_shared_info
SK_BUFF_BYTES = 256  # struct sk_buff


@lru_cache(maxsize=1 << 12)
def truesize_bytes(size_bytes: int, packets: int) -> int:
    """The memory of a train: SKB_TRUESIZE (skbuff.h) of what ``__ip_append_data`` allocates for
    each packet. Buffers are powers of two: 2304 B for a full packet, 768 B for one of 100 B."""
    if packets == 1:
        line = -(-(size_bytes - ETHERNET_BYTES + ROOM_BYTES) // 64) * 64
        return SK_BUFF_BYTES + (1 << (line + INFO_BYTES - 1).bit_length())
    return sum(truesize_bytes(each, 1) for each in packet_sizes(size_bytes, packets))


@lru_cache(maxsize=1 << 12)
def truesize_before_last(size_bytes: int, packets: int, each: int) -> int:
    """The memory of all datagrams but the last of a train; each has ``each`` packets."""
    before = (packets - 1) // each * each
    return sum(truesize_bytes(one, 1) for one in packet_sizes(size_bytes, packets)[:before])
