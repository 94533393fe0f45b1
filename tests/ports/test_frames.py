"""Frames to several receivers, and the packets of a train."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from desim.ports import FULL_PACKET_BYTES, Frame, packet_sizes
from desim.ports.frames import Frames


def test_frames_to_several_receivers_are_numbered_in_their_order():
    frames = Frames(7, 2, (5, 0, 9), 100, 1)
    assert frames.singly() == [Frame(7, 2, (5,), 100, 1, False), Frame(8, 2, (0,), 100, 1, False),
                               Frame(9, 2, (9,), 100, 1, False)]


HOSTS = st.integers(-1, 7)


@given(st.integers(0, 6), st.sets(st.integers(0, 6), min_size=1), st.lists(HOSTS, unique=True))
def test_among_hosts_are_those_that_a_search_finds(source, receivers, hosts):
    receivers = tuple(sorted(receivers - {source})) or (source + 1,)
    frame = Frame(1, source, receivers, 100, 1, True)
    assert frame.among(hosts) == [host for host in hosts if host in receivers]


@pytest.mark.parametrize("source, hosts", [(0, [-1, 0, 1, 2, 3]), (3, [2, 0, 3, 4]), (2, [3, 1]),
                                           (5, [4, 0]), (1, [])])
def test_among_hosts_of_a_broadcast_to_all(source, hosts):
    """All hosts up to the last but the source, which may also come behind them."""
    receivers = tuple(host for host in range(4) if host != source)
    assert Frame(1, source, receivers, 100, 1, True).among(hosts) == [
        host for host in hosts if host in receivers]


@pytest.mark.parametrize("size_bytes, segments, sizes", [
    (1518, 1, (1518,)), (1519, 2, (1518, 1)), (3036, 2, (1518, 1518)),
    (4000, 3, (1518, 1518, 964)),
    (1518, 2, (759, 759)),  # of full ones nothing would be left for the second
    (3037, 2, (1519, 1518)), (101, 4, (26, 25, 25, 25))])  # no full ones: as equal as possible
def test_packets_of_a_train_are_full_where_that_fits(size_bytes, segments, sizes):
    """IEEE 802.3: 1500 bytes of data, 14 of the header, 4 of the check sequence."""
    assert FULL_PACKET_BYTES == 1518
    assert packet_sizes(size_bytes, segments) == sizes
