"""The rows of UDP in ``desim validate --only middleware``: a few that are quick.

Each has a twin in which a buffer is not as Linux has it.
"""

from collections.abc import Callable
from functools import partial
from typing import NamedTuple

import pytest

from desim.middleware.host import Host
from desim.middleware.udp import socket
from desim.middleware.udp.reassembly import Reassembly
from desim.middleware.udp.receiver import ReceiveBuffer
from desim.validation import udp


class Twin(NamedTuple):
    """The names of some rows, and what is made wrong."""

    names: tuple[str, ...]
    wrong: Callable


def nobody_waits(monkeypatch):
    monkeypatch.setattr(Host, "block", lambda host, node: None)
    monkeypatch.setattr(Host, "unblock", lambda host, node: None)


def buffers_count_bytes(monkeypatch):
    """Not the memory that packets take."""
    monkeypatch.setattr(socket, "truesize_bytes", lambda size_bytes, packets: size_bytes)


def room_at_once(monkeypatch):
    """Waiting ends as soon as there is any room."""
    monkeypatch.setattr(socket, "HALF", 1)


def memory_comes_back_at_once(monkeypatch):
    def read(buffer):
        buffer._taken_bytes -= buffer._waiting.popleft()

    monkeypatch.setattr(ReceiveBuffer, "read", read)


def memory_without_end(monkeypatch):
    """Fragments wait in as much memory as they need."""
    whole = Reassembly.__init__
    monkeypatch.setattr(Reassembly, "__init__", lambda self, limit_bytes, time_ns: whole(
        self, 1 << 40, time_ns))


def what_has_begun_ends(monkeypatch):
    """A datagram that has begun in time is put together, however little room there is."""
    def take(memory, now_ns, size_bytes, packets, each, lost):
        full = memory._kept_bytes > memory._limit_bytes
        limit_bytes, memory._limit_bytes = memory._limit_bytes, 0 if full else 1 << 40
        try:
            return whole(memory, now_ns, size_bytes, packets, each, lost)
        finally:
            memory._limit_bytes = limit_bytes

    whole = Reassembly.take
    monkeypatch.setattr(Reassembly, "take", take)


TWINS = [
    Twin(("camera", "beside", "60k_5", "110k_25", "two"), nobody_waits),
    Twin(("camera", "60k_25", "60k_5", "two_60k"), buffers_count_bytes),
    Twin(("105k_25", "half_buffer", "four_buffers_20k", "187k_100_fast"), room_at_once),
    Twin(("reader_50_1k", "reader_50_20k", "reader_50_60k"), memory_comes_back_at_once),
    Twin(("lossy_1", "lossy_3", "lossy_1_slow"), memory_without_end),
    Twin(("fragments_6_2", "fragments_3_3", "fragments_2_5"), what_has_begun_ends),
]


@pytest.mark.parametrize("twin", TWINS, ids=lambda twin: twin.wrong.__name__)
def test_rows_agree_and_their_twin_does_not(monkeypatch, twin):
    rows = partial(udp.ages, [path for path in udp.paths() if path.name in twin.names])
    checks = list(rows())
    assert len(checks) >= len(twin.names) and [check for check in checks if not check.holds] == []
    twin.wrong(monkeypatch)
    assert not all(check.holds for check in rows())
