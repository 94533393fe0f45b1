"""Real frames by their headers."""

from __future__ import annotations

import re
import struct

import pytest
from ethernet import ARP, frame, ipv4, tcp, udp
from hypothesis import example, given
from hypothesis import strategies as st

from desim.loop.packets import protocol_of, size_on_wire, topic_of

TOPIC = re.compile(r"/(arp|ipv6|icmp|igmp|(tcp|udp)(/(\d+|dynamic))?|ip_\d+|ethertype_[0-9a-f]{4})")


@pytest.mark.parametrize(("sent", "topic", "protocol"), [
    (frame(kind=ARP), "/arp", "arp"),
    (frame(kind=0x86DD), "/ipv6", "udp"),
    (frame(kind=0x88CC), "/ethertype_88cc", "udp"),
    (frame(ipv4(1)), "/icmp", "udp"),
    (frame(ipv4(2)), "/igmp", "udp"),
    (frame(ipv4(89)), "/ip_89", "udp"),
    (frame(tcp(40_000, 11_311)), "/tcp/11311", "tcp"),
    (frame(tcp(11_311, 40_000)), "/tcp/11311", "tcp"),
    (frame(tcp(80, 443)), "/tcp/80", "tcp"),
    (frame(udp(7400, 7410)), "/udp/7400", "udp"),
    (frame(udp(32_768, 60_000)), "/udp/dynamic", "udp"),
    (frame(udp(32_767, 60_000)), "/udp/32767", "udp"),
    (frame(udp(7400, 7410, options=b"\x94\x04\0\0")), "/udp/7400", "udp"),  # a router alert
    (frame(udp(7400, 7410, fragment=185)), "/udp", "udp"),  # its ports are in the first fragment
    (frame(udp(7400, 7410, more=True)), "/udp/7400", "udp"),  # which this is
    (frame(ipv4(17, struct.pack(">H", 7400))), "/udp", "udp"),  # cut within its ports
])
def test_a_frame_has_the_topic_of_its_headers(sent, topic, protocol):
    assert topic_of(sent) == topic
    assert protocol_of(topic) == protocol


@given(st.binary(max_size=80))
@example(b"")
@example(frame(b"\x4f"))
@example(frame(ipv4(6))[:33])
def test_any_bytes_have_a_topic(sent):
    topic = topic_of(sent)
    assert TOPIC.fullmatch(topic)
    assert protocol_of(topic) in ("tcp", "arp", "udp")


@given(st.integers(0, 65_535), st.integers(0, 65_535), st.sampled_from([tcp, udp]))
def test_both_directions_of_a_conversation_have_one_topic(port, other, made):
    assert topic_of(frame(made(port, other))) == topic_of(frame(made(other, port)))


@pytest.mark.parametrize(("length", "on_wire"), [(14, 64), (59, 64), (60, 64), (61, 65),
                                                (1514, 1518)])
def test_a_frame_on_a_medium_has_its_check_sequence_and_is_no_short_one(length, on_wire):
    assert size_on_wire(bytes(length)) == on_wire
