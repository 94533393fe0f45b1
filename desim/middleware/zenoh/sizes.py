"""Bytes of Zenoh's messages on a link, each with the 2-byte length of its batch, without TCP.

Measured with routers of zenoh 1.10.2 over TCP on one machine; what was not measured says so.
"""

from __future__ import annotations

from functools import lru_cache

from desim.middleware.headers import UDP_HEADER_BYTES

SCOUT_BYTES = 3 + UDP_HEADER_BYTES
HELLO_BYTES = 40 + UDP_HEADER_BYTES  # estimate: 19 B of head and id, one locator of 21 B

INIT_SYN_BYTES = 34
INIT_ACK_BYTES = 93
OPEN_SYN_BYTES = 78
OPEN_ACK_BYTES = 19
KEEP_ALIVE_BYTES = 3

# A list of link states: its head, a state, the identity of a router that the link has not seen yet,
# its address, one of its neighbours; and a router of which nothing but the identity is known.
STATES_BYTES = 15
STATE_BYTES = 5
IDENTITY_BYTES = 17
LOCATOR_BYTES = 21
NEIGHBOUR_BYTES = 1
STUB_BYTES = 22

INTEREST_BYTES = 5  # of a peer, in the declarations of another one

DECLARATIONS_BYTES = 7  # the head of a batch of declarations
DECLARE_BYTES = 15  # one of them, beside its key

# A message: with time stamp, and the 33 B that rmw_zenoh attaches (number, time, publisher).
PUSH_BYTES = 72
FRAGMENT_BYTES = 10  # each further batch of a message

# Parts of rmw_zenoh's keys, as its documents have them.
TYPE_BYTES = 35  # nav_msgs::msg::dds_::OccupancyGrid_; types are unknown here
HASH_BYTES = 71  # RIHS01_ and 64 digits
SPACE_BYTES = 11  # @ros2_lv/0/
SESSION_BYTES = 32
QOS_BYTES = 11  # ::,1:,:,:,,


def subscriber_bytes(topic: str) -> int:
    """The declaration of a subscriber: 0/topic/type/hash."""
    return _declare(2 + len(topic.lstrip("/")) + 1 + TYPE_BYTES + 1 + HASH_BYTES)


def node_bytes(node: str) -> int:
    """The liveliness token of a node: @ros2_lv/0/session/0/0/NN/%/%/node."""
    return _declare(SPACE_BYTES + SESSION_BYTES + len("/0/0/NN/%/%/") + len(node))


def token_bytes(node: str, topic: str) -> int:
    """The liveliness token of a publisher or subscriber:
    @ros2_lv/0/session/0/11/MS/%/%/node/topic/type/hash/qos."""
    return _declare(SPACE_BYTES + SESSION_BYTES + len("/0/11/MS/%/%/") + len(node) + 1
                    + len(topic) + 1 + TYPE_BYTES + 1 + HASH_BYTES + 1 + QOS_BYTES)


@lru_cache(maxsize=1 << 12)
def push_bytes(size_bytes: int, batch_bytes: int) -> int:
    """A message of ``size_bytes``, in as many batches as it takes."""
    payload = size_bytes + PUSH_BYTES
    return payload + (payload - 1) // batch_bytes * FRAGMENT_BYTES


def _declare(key_bytes: int) -> int:
    return DECLARE_BYTES + key_bytes + (key_bytes > 127)  # its length as a variable integer
