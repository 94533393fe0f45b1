"""How many bytes DDS says things in: RTPS 2.x messages over UDP over Ethernet.

Lengths of submessages are those of the RTPS specification, with their 4 B headers. Parameter lists
of discovery were read off packets of Cyclone DDS 11.0.1 (a ROS 2 node's 17 endpoints, on loopback);
Fast DDS was not measured and is taken to need as much.
"""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

UDP_BYTES = 14 + 4 + 20 + 8  # Ethernet, its check sequence, IP, UDP
FRAGMENT_BYTES = 14 + 4 + 20  # around each further IP fragment of a datagram
IP_PAYLOAD_BYTES = 1500 - 20
HEADER_BYTES = 20
TIME_BYTES = 12  # INFO_TS
TO_BYTES = 16  # INFO_DST
DATA_BYTES = 24
DATA_FRAG_BYTES = 36
ENCAPSULATION_BYTES = 4
HEARTBEAT_BYTES = 32
HEARTBEAT_FRAG_BYTES = 28
GAP_BYTES = 32
ACKNACK_BYTES = 28  # and 4 for every 32 numbers that it asks for
NACK_FRAG_BYTES = 36  # and 4 for every 32 fragments of a sample
ANNOUNCEMENT_BYTES = 304  # a DATA of SPDP (measured)
LIVELINESS_BYTES = 52  # a DATA of ParticipantMessageData (measured)
TRAIN_BYTES = 65_536  # of a frame where frames get lost: as much as Linux' GSO puts together
LONG_TRAIN_BYTES = 6 * TRAIN_BYTES  # of a frame otherwise: a map of 400 x 400 cells is one
BUILT_IN_WRITERS = 5  # publications, subscriptions, liveliness, type look-up and its replies

TYPE_NAME = "nav_msgs::msg::dds_::OccupancyGrid_"  # stands for the type of any topic of the robots
QUEUED, LATCHED = 12, 8  # B of a history that is not KEEP_LAST(1), of TRANSIENT_LOCAL

# A ROS 2 node without topics of its own: kind, topic, type, bytes of its quality of service.
# Eight writers and seven readers of the node, one of each of its context (ros_discovery_info).
_INFO = ("ros_discovery_info", "rmw_dds_common::msg::dds_::ParticipantEntitiesInfo_")
_EVENTS = ("rt/parameter_events", "rcl_interfaces::msg::dds_::ParameterEvent_")
_SERVICES = ("GetParameters", "GetParameterTypes", "SetParameters", "SetParametersAtomically",
             "DescribeParameters", "ListParameters")


class Chunk(NamedTuple):
    """One UDP message, or several in a train: bytes with all headers, and IP packets."""

    size_bytes: int
    packets: int


@lru_cache(maxsize=1 << 12)
def udp(rtps_bytes: int) -> Chunk:
    """An RTPS message of so many bytes. What does not fit one packet is cut by IP."""
    packets = -(-(rtps_bytes + 8) // IP_PAYLOAD_BYTES)
    return Chunk(rtps_bytes + UDP_BYTES + (packets - 1) * FRAGMENT_BYTES, packets)


@lru_cache(maxsize=1 << 12)
def messages(size_bytes: int, whole_bytes: int, heartbeat: bool) -> tuple[Chunk, ...]:
    """The UDP messages of a sample of ``size_bytes``, at most ``whole_bytes`` of it in each; with
    a heartbeat behind them, and behind each but the last one a heartbeat of fragments."""
    payload = size_bytes + ENCAPSULATION_BYTES
    last = HEARTBEAT_BYTES * heartbeat
    if payload <= whole_bytes:
        return (udp(HEADER_BYTES + TIME_BYTES + DATA_BYTES + payload + last),)
    chunks = []
    while payload > 0:
        part = min(payload, whole_bytes)
        payload -= part
        chunks.append(udp(HEADER_BYTES + TIME_BYTES * (not chunks) + DATA_FRAG_BYTES + part
                          + (HEARTBEAT_FRAG_BYTES * heartbeat if payload else last)))
    return tuple(chunks)


@lru_cache(maxsize=1 << 12)
def trains(size_bytes: int, fragment_bytes: int, most: int, heartbeat: bool,
           train_bytes: int = TRAIN_BYTES) -> tuple[tuple[range, Chunk], ...]:
    """``messages`` of at most ``most`` fragments as frames of up to ``train_bytes``, which arrive
    or get lost as a whole: which fragments each is made of, and all of its messages together."""
    out: list[tuple[range, Chunk]] = []
    last = fragments(size_bytes, fragment_bytes)
    for k, chunk in enumerate(messages(size_bytes, most * fragment_bytes, heartbeat)):
        first = k * most
        if out and out[-1][1].size_bytes + chunk.size_bytes <= train_bytes:
            part, before = out.pop()
            first = part.start
            chunk = Chunk(before.size_bytes + chunk.size_bytes, before.packets + chunk.packets)
        out.append((range(first, min(last, (k + 1) * most)), chunk))
    return tuple(out)


def fragments(size_bytes: int, fragment_bytes: int) -> int:
    """How many fragments a sample has."""
    return -(-(size_bytes + ENCAPSULATION_BYTES) // fragment_bytes)


@lru_cache(maxsize=1 << 12)
def repetition(size_bytes: int, fragment_bytes: int, part: range, heartbeat: bool) -> Chunk:
    """``part`` of the fragments of a sample, counted from 0, each in a UDP message of its own, with
    a heartbeat in the last one."""
    payload = size_bytes + ENCAPSULATION_BYTES
    head = DATA_BYTES if payload <= fragment_bytes else DATA_FRAG_BYTES
    chunks = [udp(HEADER_BYTES + TIME_BYTES + head
                  + min(fragment_bytes, payload - index * fragment_bytes)
                  + HEARTBEAT_BYTES * (heartbeat and index == part[-1])) for index in part]
    return Chunk(sum(chunk.size_bytes for chunk in chunks), sum(chunk.packets for chunk in chunks))


def _padded(name: str) -> int:
    """A string of CDR: its characters and a NUL, up to a multiple of 4."""
    return (len(name) + 4) // 4 * 4


def writer_bytes(topic: str, type_name: str, quality: int) -> int:
    """A DATA that announces a writer: measured ones are 196 B and its names and qualities."""
    return 196 + _padded(topic) + _padded(type_name) + quality


def reader_bytes(topic: str, type_name: str, quality: int) -> int:
    """A DATA that announces a reader: 28 B more, as best effort is what need not be said."""
    return 224 + _padded(topic) + _padded(type_name) + quality


def built_in_endpoints(host: str) -> list[int]:
    """Bytes of the DATA of each endpoint that a ROS 2 node has anyway, in the order of making."""
    sizes = [writer_bytes(*_INFO, LATCHED), reader_bytes(*_INFO, QUEUED + LATCHED),
             writer_bytes("rt/rosout", "rcl_interfaces::msg::dds_::Log_", QUEUED + LATCHED),
             writer_bytes(*_EVENTS, QUEUED), reader_bytes(*_EVENTS, QUEUED)]
    for service in _SERVICES:
        snake = "".join(f"_{letter.lower()}" if letter.isupper() else letter for letter in service)
        sizes += [reader_bytes(f"rq/{host}/{snake[1:]}Request",
                               f"rcl_interfaces::srv::dds_::{service}_Request_", QUEUED),
                  writer_bytes(f"rr/{host}/{snake[1:]}Reply",
                               f"rcl_interfaces::srv::dds_::{service}_Response_", QUEUED)]
    return sizes


def announcement(times: int = 1) -> Chunk:
    """SPDP: ``times`` announcements in one message."""
    return udp(HEADER_BYTES + TO_BYTES + times * (TIME_BYTES + ANNOUNCEMENT_BYTES))


def heartbeats(writers: int) -> Chunk:
    return udp(HEADER_BYTES + TO_BYTES + writers * HEARTBEAT_BYTES)


def acknacks(readers: int, asked: int = 0, fragments: int = 0) -> Chunk:
    """``asked``: numbers that are asked for; ``fragments``: those of one sample more."""
    parts = NACK_FRAG_BYTES - (-fragments // 32) * 4 if fragments else 0
    return udp(HEADER_BYTES + TO_BYTES + readers * ACKNACK_BYTES + -(-asked // 32) * 4 + parts)


def gap() -> Chunk:
    return udp(HEADER_BYTES + TO_BYTES + GAP_BYTES + HEARTBEAT_BYTES)


def liveliness() -> Chunk:
    return udp(HEADER_BYTES + TIME_BYTES + LIVELINESS_BYTES + HEARTBEAT_BYTES)


def endpoints(sizes: list[int], message_bytes: int, heartbeat: bool, addressed: bool
              ) -> list[Chunk]:
    """SEDP: the messages of so many samples, as many in each as fit ``message_bytes`` (0: one);
    with the heartbeats of both its writers in the last one; ``addressed`` to one participant."""
    messages, room = [], 0
    for size in sizes:
        need = TIME_BYTES + size
        if need > room:
            messages.append(HEADER_BYTES + TO_BYTES * addressed)
            room = message_bytes - messages[-1]
        messages[-1] += need
        room -= need
    messages[-1] += 2 * HEARTBEAT_BYTES * heartbeat
    return [udp(size) for size in messages]
