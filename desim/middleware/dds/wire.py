"""The bytes of DDS on the wire: RTPS 2.x messages over UDP over Ethernet.

Lengths of submessages are those of the RTPS specification, with their 4 B headers. What differs
between implementations is read off packets (see docs/middleware/dds.md): ``CYCLONEDDS`` 11.0.1 and
``FASTDDS`` 2.9.1 as Debian builds it.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from functools import cache
from typing import NamedTuple, TypeVar

from desim.middleware.headers import ETHERNET_BYTES, IP_BYTES, MTU_BYTES, UDP_HEADER_BYTES

FRAGMENT_BYTES = ETHERNET_BYTES + IP_BYTES  # around each further IP fragment of a datagram
IP_PAYLOAD_BYTES = MTU_BYTES - IP_BYTES
HEADER_BYTES = 20
TIME_BYTES = 12  # INFO_TS
TO_BYTES = 16  # INFO_DST
DATA_BYTES = 24
DATA_FRAG_BYTES = 36
ENCAPSULATION_BYTES = 4
HEARTBEAT_BYTES = 32
HEARTBEAT_FRAG_BYTES = 28
GAP_BYTES = 32
BUNDLED_BYTES = 72  # a DATA beside its sample, and a heartbeat
ACKNACK_BYTES = 28  # and 4 for every 32 numbers that it asks for
NACK_FRAG_BYTES = 36  # and 4 for every 32 fragments of a sample
LIVELINESS_BYTES = 52  # a DATA of ParticipantMessageData (measured)
TRAIN_BYTES = 65_536  # of a frame at first: as much as Linux' GSO puts together
LONG_TRAIN_BYTES = 6 * TRAIN_BYTES  # of a frame where nothing waits: a map of 400 x 400 cells

TYPE_NAME = "nav_msgs::msg::dds_::OccupancyGrid_"  # stands for the type of any topic of the robots
QUEUED, LATCHED = 12, 8  # B of a history that is not KEEP_LAST(1), of TRANSIENT_LOCAL

# Topics and types of the endpoints of a ROS 2 node without topics of its own: eight writers and
# seven readers of the node, one of each of its context (ros_discovery_info).
_INFO = ("ros_discovery_info", "rmw_dds_common::msg::dds_::ParticipantEntitiesInfo_")
_EVENTS = ("rt/parameter_events", "rcl_interfaces::msg::dds_::ParameterEvent_")
_LOG = ("rt/rosout", "rcl_interfaces::msg::dds_::Log_")
_SERVICES = ("GetParameters", "GetParameterTypes", "SetParameters", "SetParametersAtomically",
             "DescribeParameters", "ListParameters")

# Host index, which of the host's lives (a new one at every start), and which of its participants.
Guid = tuple[int, int, int]


class WireSize(NamedTuple):
    """One UDP message, or several in a train: bytes with all headers, and IP packets."""

    size_bytes: int
    packets: int


class SedpSize(NamedTuple):
    """A message of discovery, and the number of its items."""

    size: WireSize
    items: int


class DataKind(StrEnum):
    """The kinds of items of discovery."""

    WRITER = "writer"
    READER = "reader"
    BUILT_IN_WRITER = "built_in_writer"  # one that every node has
    BUILT_IN_READER = "built_in_reader"
    PARTICIPANT = "participant"
    GONE = "gone"  # a participant


class DiscoveredData(NamedTuple):
    """One item of discovery: an announcement about ``owner`` and, for an endpoint, its ``topic``
    (of one that every node has, only if it is ever matched)."""

    owner: Guid
    kind: DataKind
    topic: str
    size_bytes: int


# Kinds of items that the writer of subscriptions announces, not the one of publications.
READERS = (DataKind.READER, DataKind.BUILT_IN_READER)


class DdsMessage(NamedTuple):
    """One UDP message of a sample: its IP packets, the fragments in it, and whether a heartbeat
    rides on it."""

    packets: int
    part: range
    beats: bool


class SampleTrain(NamedTuple):
    """Messages of a sample in one frame, and the fragments in them."""

    part: range
    size: WireSize
    messages: tuple[DdsMessage, ...]
    beats: bool  # on any of them


class SedpMessage(NamedTuple):
    """One message of discovery in a train: its packets, its items with their numbers, and, if a
    heartbeat rides on it, the number of existing items."""

    packets: int
    items: tuple[tuple[int, DiscoveredData], ...]
    known: int | None


M = TypeVar("M", DdsMessage, SedpMessage)


def whole(messages: Iterable[M], lost: Collection[int]) -> list[M]:
    """The messages of a train that are whole, where these of its packets are lost."""
    if not lost:
        return list(messages)
    out, start = [], 0
    for message in messages:
        if not any(number in lost for number in range(start, start + message.packets)):
            out.append(message)
        start += message.packets
    return out


def together(sizes: Sequence[WireSize]) -> WireSize:
    """These messages as one train."""
    if len(sizes) == 1:
        return sizes[0]
    sizes_bytes, packets = zip(*sizes, strict=True)
    return WireSize(sum(sizes_bytes), sum(packets))


@dataclass(frozen=True, eq=False)
class RtpsVendor:
    """The RTPS messages of one implementation."""

    announcement_bytes: int  # of a DATA that announces a participant
    writer_base_bytes: int  # of one that announces a writer, without its names
    reader_base_bytes: int
    qualities: bool  # both grow by the qualities of service that are not default
    trailer_bytes: int  # behind each message
    built_in_writers: int  # of discovery: each has its heartbeats and acknowledgements
    apart: bool  # each of these is a message of its own
    address_bytes: int  # of each message of a sample: the participant that it is for
    fragment_beat_bytes: int  # behind each message of a sample but the last
    several_nack_frags: bool  # a reader asks for fragments of several samples in one message
    bundles_bytes: int  # at most, of a message of whole samples that are repeated; 0: each alone

    @cache  # noqa: B019 - there are three vendors
    def udp(self, rtps_bytes: int) -> WireSize:
        """An RTPS message of so many bytes in a UDP datagram. IP fragments it if it does not fit
        one packet."""
        size_bytes = rtps_bytes + self.trailer_bytes
        packets = -(-(size_bytes + 8) // IP_PAYLOAD_BYTES)
        return WireSize(size_bytes + UDP_HEADER_BYTES + (packets - 1) * FRAGMENT_BYTES, packets)

    @property
    def head_bytes(self) -> int:
        """The bytes of a message without any submessage."""
        return HEADER_BYTES + self.trailer_bytes

    # Samples.

    def messages(self, size_bytes: int, fragment_bytes: int, most: int) -> tuple[int, ...]:
        """RTPS bytes of each UDP message of a sample, with at most ``most`` fragments in each; no
        heartbeat counted."""
        payload = size_bytes + ENCAPSULATION_BYTES
        head = HEADER_BYTES + self.address_bytes
        if payload <= fragment_bytes:
            return (head + TIME_BYTES + DATA_BYTES + payload,)
        whole = most * fragment_bytes  # each message to one reader repeats the time
        return tuple(head + TIME_BYTES * bool(self.address_bytes or start == 0) + DATA_FRAG_BYTES
                     + min(whole, payload - start) for start in range(0, payload, whole))

    def trains(self, size_bytes: int, fragment_bytes: int, most: int, beats: Sequence[bool],
               train_bytes: int = TRAIN_BYTES) -> tuple[SampleTrain, ...]:
        """``messages`` as frames of up to ``train_bytes``. ``beats``: whether a heartbeat rides on
        each (empty: on none)."""
        out: list[SampleTrain] = []
        last = -(-(size_bytes + ENCAPSULATION_BYTES) // fragment_bytes)  # fragments
        lengths = self.messages(size_bytes, fragment_bytes, most)
        for k, length in enumerate(lengths):
            rides, before_last = bool(beats) and beats[k], bool(beats) and k + 1 < len(lengths)
            size = self.udp(length + HEARTBEAT_BYTES * rides
                             + self.fragment_beat_bytes * before_last)
            part = range(k * most, min(last, (k + 1) * most))
            message = DdsMessage(size.packets, part, rides)
            if out and out[-1].size.size_bytes + size.size_bytes <= train_bytes:
                before = out.pop()
                out.append(SampleTrain(range(before.part.start, part.stop),
                                 together((before.size, size)), (*before.messages, message),
                                 before.beats or rides))
            else:
                out.append(SampleTrain(part, size, (message,), rides))
        return tuple(out)

    def repetition(self, size_bytes: int, fragment_bytes: int, part: range, beats: Sequence[bool]
                   ) -> SampleTrain:
        """The fragments ``part`` of a sample, counted from 0, each in a message of its own."""
        payload = size_bytes + ENCAPSULATION_BYTES
        head = HEADER_BYTES + TO_BYTES + (DATA_BYTES if payload <= fragment_bytes
                                          else DATA_FRAG_BYTES)
        sizes = [self.udp(head + TIME_BYTES * bool(self.address_bytes or index == 0)
                           + HEARTBEAT_BYTES * rides
                           + min(fragment_bytes, payload - index * fragment_bytes))
                  for index, rides in zip(part, beats, strict=True)]
        messages = tuple(DdsMessage(size.packets, range(index, index + 1), rides)
                         for size, index, rides in zip(sizes, part, beats, strict=True))
        return SampleTrain(part, together(sizes), messages, any(beats))

    def bundle(self, sizes: Sequence[int], beats: int) -> WireSize:
        """One message of whole samples of these sizes, with so many heartbeats."""
        return self.udp(HEADER_BYTES + TO_BYTES + beats * HEARTBEAT_BYTES
                        + sum(TIME_BYTES + DATA_BYTES + ENCAPSULATION_BYTES + size
                              for size in sizes))

    # Discovery.

    def writer_bytes(self, topic: str, type_name: str, quality: int) -> int:
        """The bytes of a DATA that announces a writer."""
        return (self.writer_base_bytes + _padded(topic) + _padded(type_name)
                + quality * self.qualities)

    def reader_bytes(self, topic: str, type_name: str, quality: int) -> int:
        """The bytes of a DATA that announces a reader."""
        return (self.reader_base_bytes + _padded(topic) + _padded(type_name)
                + quality * self.qualities)

    def built_in_endpoints(self, owner: Guid, node: str) -> list[DiscoveredData]:
        """The endpoints that every ROS 2 node has, in the order of their creation. Those that are
        ever matched have a topic."""
        def writes(topic: str, type_name: str, quality: int, matched: str = "") -> DiscoveredData:
            return DiscoveredData(owner, DataKind.BUILT_IN_WRITER, matched,
                        self.writer_bytes(topic, type_name, quality))

        def reads(topic: str, type_name: str, quality: int, matched: str = "") -> DiscoveredData:
            return DiscoveredData(owner, DataKind.BUILT_IN_READER, matched,
                        self.reader_bytes(topic, type_name, quality))

        out = [writes(*_INFO, LATCHED, "info"), reads(*_INFO, QUEUED + LATCHED, "info"),
               writes(*_LOG, QUEUED + LATCHED), writes(*_EVENTS, QUEUED, "events"),
               reads(*_EVENTS, QUEUED, "events")]
        for service in _SERVICES:
            snake = "".join(f"_{letter.lower()}" if letter.isupper() else letter
                            for letter in service)[1:]
            kind = f"rcl_interfaces::srv::dds_::{service}"
            out += [reads(f"rq/{node}/{snake}Request", f"{kind}_Request_", QUEUED),
                    writes(f"rr/{node}/{snake}Reply", f"{kind}_Response_", QUEUED)]
        return out

    def announcement(self, times: int = 1) -> WireSize:
        """SPDP: ``times`` announcements in one message."""
        to = 0 if self.apart else TO_BYTES
        return self.udp(HEADER_BYTES + to + times * (TIME_BYTES + self.announcement_bytes))

    @cache  # noqa: B019 - there are three vendors
    def _control(self, submessages: int, each_bytes: int, more_bytes: int = 0) -> WireSize:
        """So many heartbeats or acknowledgements for one participant."""
        head = HEADER_BYTES + TO_BYTES
        if not self.apart:
            return self.udp(head + submessages * each_bytes + more_bytes)
        first = self.udp(head + each_bytes + more_bytes)
        return together([first, *[self.udp(head + each_bytes)] * (submessages - 1)])

    def heartbeats(self, writers: int) -> WireSize:
        """Heartbeats of so many writers for one participant."""
        return self._control(writers, HEARTBEAT_BYTES)

    def heartbeat_to_all(self) -> WireSize:
        """The heartbeat of one writer for nobody in particular."""
        return self.udp(HEADER_BYTES + HEARTBEAT_BYTES)

    def acknacks(self, readers: int, asked: int = 0, fragments: Sequence[int] = ()) -> WireSize:
        """Acknowledgements of so many readers that request ``asked`` whole samples, and of further
        samples so many ``fragments`` each."""
        parts = sum(NACK_FRAG_BYTES - (-count // 32) * 4 for count in fragments)
        return self._control(readers, ACKNACK_BYTES, -(-asked // 32) * 4 + parts)

    def gap(self) -> WireSize:
        """The bytes of a GAP and a heartbeat."""
        return self.udp(HEADER_BYTES + TO_BYTES + GAP_BYTES + HEARTBEAT_BYTES)

    def liveliness(self) -> WireSize:
        """An assertion of liveliness, with a heartbeat that asks for an answer."""
        return self.udp(HEADER_BYTES + TIME_BYTES + LIVELINESS_BYTES + HEARTBEAT_BYTES)

    def new_endpoints(self, items: Sequence[DiscoveredData], addressed: bool) -> list[SedpSize]:
        """SEDP: each in a message of its own, which may be ``addressed`` to one participant."""
        head = HEADER_BYTES + TO_BYTES * addressed + TIME_BYTES
        return self._each(head, *[item.size_bytes for item in items])

    @cache  # noqa: B019 - there are three vendors
    def _each(self, head_bytes: int, *sizes: int) -> list[SedpSize]:
        """A message for each item of these sizes."""
        return [SedpSize(self.udp(head_bytes + size), 1) for size in sizes]

    def known_endpoints(self, items: Sequence[DiscoveredData], message_bytes: int, beats: bool,
                        addressed: bool = True) -> list[SedpSize]:
        """SEDP: the items that a participant has requested, or several, as many in each message as
        fit ``message_bytes``; ``beats``: the heartbeats of both writers ride on the last one. Where
        messages are apart, those of writers and of readers are; ``items`` are in this order."""
        sizes: list[int] = []
        counts: list[int] = []
        left_bytes, before = 0, None
        for item in items:
            need, is_reader = TIME_BYTES + item.size_bytes, item.kind in READERS
            if need > left_bytes or (self.apart and before != is_reader):
                sizes.append(HEADER_BYTES + TO_BYTES * addressed)
                counts.append(0)
                left_bytes = message_bytes - sizes[-1]
            before = is_reader
            sizes[-1] += need
            counts[-1] += 1
            left_bytes -= need
        sizes[-1] += 2 * HEARTBEAT_BYTES * beats
        return [SedpSize(self.udp(size), count) for size, count in zip(sizes, counts, strict=True)]


def _padded(name: str) -> int:
    """The bytes of a string in CDR: its characters and a NUL, up to a multiple of 4."""
    return (len(name) + 4) // 4 * 4


# Measured: a ROS 2 node's 17 endpoints, AllowMulticast spdp. Best effort is the default, so that a
# reader takes 28 B more; built-in writers: publications, subscriptions, liveliness, type look-up
# and its replies.
CYCLONEDDS = RtpsVendor(announcement_bytes=304, writer_base_bytes=196, reader_base_bytes=224,
                  qualities=True, trailer_bytes=0, built_in_writers=5, apart=False,
                  address_bytes=0, fragment_beat_bytes=HEARTBEAT_FRAG_BYTES,
                  several_nack_frags=False, bundles_bytes=0)
# Its announcement names multicast addresses, too, where it uses them for everything.
CYCLONEDDS_MULTICAST = replace(CYCLONEDDS, announcement_bytes=360)
# Measured: it always announces all qualities; the submessage 0x80 of the statistics module follows
# each message.
FASTDDS = RtpsVendor(announcement_bytes=356, writer_base_bytes=340, reader_base_bytes=340,
               qualities=False, trailer_bytes=60, built_in_writers=3, apart=True,
               address_bytes=TO_BYTES, fragment_beat_bytes=0,
               several_nack_frags=True, bundles_bytes=65_000)
