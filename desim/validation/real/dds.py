"""DDS: participants that find each other, samples under loss, cuts.

Each participant has the 17 endpoints of a ROS 2 node. Where computing takes no time, endpoints are
there as soon as their participant is.
"""

from __future__ import annotations

import hashlib
import sys
from collections.abc import Iterator, Sequence

from desim.compiler.folder import own_folder
from desim.validation.real.cell import PROGRAMS
from desim.validation.real.judge import JudgedRow, Need
from desim.validation.real.media import JudgedMedium, access_point, cut, lan, lost, radio
from desim.validation.real.peers import (
    Listened,
    PeerNode,
    PeerSoftware,
    PeerTalk,
    Published,
    judged_row,
    leaving,
    talk,
)

_AT_ONCE = {"start_spread": "0 ns", "endpoint_delay": "0 ns"}
CYCLONE = PeerSoftware("Cyclone DDS", "$DESIM_PYTHON cyclone_node.py spdp", {
    "model": "dds", "preset": "cyclonedds_11_0", "constants": _AT_ONCE})
CYCLONE_MULTICAST = PeerSoftware("Cyclone DDS by multicast", "$DESIM_PYTHON cyclone_node.py true", {
    "model": "dds", "preset": "cyclonedds_11_0", "allow_multicast": "all", "constants": _AT_ONCE})
_FAST_SOURCE = PROGRAMS / "fast_node.cpp"
_LOSS_FROM_S = 4.0


def fleet(hosts: int, topics: int) -> dict[str, PeerNode]:
    """Hosts that all publish and read these topics, and never send a sample."""
    names = [f"/t{topic}" for topic in range(topics)]
    return {f"peer_{k}": PeerNode([Published(name) for name in names],
                              [Listened(name) for name in names]) for k in range(hosts)}


def _discovery(hosts: int, topics: int) -> PeerTalk:
    return PeerTalk(f"first 15 s of {hosts} hosts, {topics} topics", lan(), fleet(hosts, topics),
                    15)


def _processes(hosts: int, participants: int, network: JudgedMedium, where: str = "") -> PeerTalk:
    """Robots whose nodes are processes of their own, and start within 50 ms each."""
    return PeerTalk(f"first 15 s of {hosts} hosts with {participants} participants{where}", network,
                    fleet(hosts, 1), 15, participants=participants, own={
                        "participants": participants, "constants": {
                            **_AT_ONCE, "start_spread": f"{50 * participants} ms"}})


def _lossy(size_bytes: int, rate_hz: int, loss: float, runs: int, depth: int = 10,
           reliable: bool = True) -> PeerTalk:
    return PeerTalk(f"{size_bytes} B at {rate_hz} Hz, "
                    f"{f'depth {depth}' if reliable else 'best effort'}, {100 * loss:g} % lost",
                    lan("2 ms", lost(loss, _LOSS_FROM_S)),
                    talk(size_bytes, rate_hz, 1, depth, reliable), 60, runs, _LOSS_FROM_S)


def _cut(seconds: int, depth: int) -> PeerTalk:
    until_s = 10.03 + seconds
    return PeerTalk(f"1000 B at 10 Hz, depth {depth}, cut for {seconds} s",
                    lan("50 us", cut(10.03, until_s, "*_writer")), talk(1000, 10, 1, depth),
                    round(until_s) + 30, 1, until_s=until_s)


_ON_ACCESS_POINT = PeerTalk("6 hosts on an access point, first 15 s, 1 topic", access_point(0),
                            fleet(6, 1), 15)
ROWS = (
    *(_discovery(hosts, topics) for hosts, topics in ((2, 0), (2, 1), (2, 10), (4, 0), (4, 10),
                                                      (8, 1))),
    _processes(2, 4, lan()), _processes(3, 5, lan()),
    PeerTalk("2 hosts at rest for 30 s", lan(), fleet(2, 0), 45, since_s=15.03),
    PeerTalk("4 hosts on a radio, first 15 s, 1 topic", radio(0), fleet(4, 1), 15),
    _ON_ACCESS_POINT,
    PeerTalk("1000 B at 100 Hz from the start on", lan(), talk(1000, 100), 10, begin_s=0),
    PeerTalk("1000 B at 20 Hz to one, radio", radio(1), talk(1000, 20), 20),
    PeerTalk("1000 B at 20 Hz to three, radio", radio(2), talk(1000, 20, 3), 20),
    PeerTalk("100 kB at 2 Hz, radio", radio(3), talk(100_000, 2), 20),
    _lossy(1000, 10, 0.03, 3), _lossy(1000, 10, 0.1, 3), _lossy(1000, 10, 0.1, 3, 1),
    _lossy(1000, 10, 0.1, 1, 10, False),
    _lossy(100_000, 1, 0.01, 4),
    _lossy(100_000, 1, 0.01, 2, 10, False),
    *(_cut(seconds, depth) for seconds, depth in ((5, 10), (5, 1), (20, 10), (20, 0))),
    leaving(4),
)
CYCLONE_ROWS = (*ROWS, _lossy(100_000, 1, 0.1, 4))
FAST_ROWS = (*ROWS, _lossy(100_000, 1, 0.02, 4))
# So many frames differ from guest to guest: these are alone in theirs.
CROWDED_ROWS = (_ON_ACCESS_POINT, _processes(3, 5, access_point(1), " on an access point"))
MULTICAST_ROWS = (*(_discovery(hosts, topics) for hosts, topics in ((2, 0), (2, 10), (4, 10))),
                  PeerTalk("2 hosts at rest for 30 s", lan(), fleet(2, 0), 45, since_s=15.03))
CYCLONE_NEEDS = (Need("cyclonedds for Python", [sys.executable, "-c", "import cyclonedds"],
                      "pip install cyclonedds"),)


def _fast_program() -> str:
    """The path of the program of Fast DDS, in the user's cache."""
    return str(own_folder(f"fast-{hashlib.sha256(_FAST_SOURCE.read_bytes()).hexdigest()[:12]}")
               / "fast_node")


def fast_needs() -> Sequence[Need]:
    """Fast DDS; the test makes the program."""
    return (Need("Fast DDS 2.9 for C++", ["g++", "-O1", "-o", _fast_program(), str(_FAST_SOURCE),
                                          "-lfastrtps", "-lfastcdr", "-lpthread"],
                 "apt-get install g++ libfastrtps-dev"),)


def cyclone() -> Iterator[JudgedRow]:
    """All rows of Cyclone DDS."""
    for number, row in enumerate(CYCLONE_ROWS):
        yield judged_row(row, CYCLONE, f"cyc{number}")
    for number, row in enumerate(MULTICAST_ROWS):
        yield judged_row(row, CYCLONE_MULTICAST, f"mc{number}")


def fast(rows: Sequence[PeerTalk] = FAST_ROWS, name: str = "fast") -> Iterator[JudgedRow]:
    """Rows of Fast DDS. Its topics are volatile, as ROS 2's."""
    software = PeerSoftware("Fast DDS", _fast_program(), {
        "model": "dds", "preset": "fastdds_2_9",
        "constants": {**_AT_ONCE, "heartbeat_rides": "unacknowledged"}})
    for number, row in enumerate(rows):
        yield judged_row(row, software, f"{name}{number}")
