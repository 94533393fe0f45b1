"""Zenoh: routers that find each other, messages on a radio and under loss, cuts near the lease.

The real side is a session in router mode, or a peer, with what a node of rmw_zenoh declares.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator, Mapping

from desim.validation.real.judge import JudgedRow, Need
from desim.validation.real.media import access_point, cut, lan, lost, radio
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
from desim.validation.real.tcp import GUEST

NEEDS = (Need("eclipse-zenoh for Python", [sys.executable, "-c", "import zenoh"],
              "pip install eclipse-zenoh"),)
_LOSS_FROM_S = 4.0


def software(timing: str) -> PeerSoftware:
    """A router or peer, and its model: where computing takes no time, it passes link states on at
    once."""
    own = {"preset": "zenoh", "mode": "peer"} if timing == "peer" else {"preset": timing}
    return PeerSoftware(timing, f"$DESIM_PYTHON zenoh_node.py {timing}", {
        "model": "zenoh", **own, "tcp": {"constants": GUEST},
        "constants": {"scout_jitter": "0 ns", "flood": "0 ns"}})


def fleet(hosts: int) -> dict[str, PeerNode]:
    """Hosts with nine publishers and eight subscribers each, which never send a message."""
    return {f"peer_{k}": PeerNode([Published(f"/robot_{k}/topic{j}") for j in range(9)],
                              [Listened(f"/robot_{(k + 1 + j) % hosts}/topic{j}")
                               for j in range(8)]) for k in range(hosts)}


def routers(hosts: int) -> Mapping[str, PeerNode]:
    """Routers alone."""
    return {f"peer_{k}": PeerNode() for k in range(hosts)}


def _lossy(size_bytes: int, rate_hz: int, loss: float, runs: int) -> PeerTalk:
    return PeerTalk(f"{size_bytes} B at {rate_hz} Hz, 2 ms, {100 * loss:g} % lost",
                    lan("2 ms", lost(loss, _LOSS_FROM_S)), talk(size_bytes, rate_hz), 60, runs,
                    _LOSS_FROM_S)


def _cut(seconds: int, depth: int = 10, from_s: float = 12.03) -> PeerTalk:
    until_s = from_s + seconds
    blocks = "" if depth else ", publishers block"
    return PeerTalk(f"1000 B at 10 Hz, cut for {seconds} s from {from_s} s on{blocks}",
                    lan("50 us", cut(from_s, until_s, "*_writer")), talk(1000, 10, 1, depth),
                    round(until_s) + 40, 1, until_s=until_s, apart_s=1.3)


ROWS = {
    "zenoh": (
        *(PeerTalk(f"first 15 s of {hosts} hosts", lan(), fleet(hosts), 15)
          for hosts in (2, 4, 8)),
        PeerTalk("first 15 s of 8 routers alone", lan(), routers(8), 15),
        PeerTalk("8 routers at rest for 30 s", lan(), routers(8), 45, since_s=15.03),
        PeerTalk("4 hosts on a radio, first 15 s", radio(0), fleet(4), 15),
        PeerTalk("1000 B at 100 Hz from the start on", lan(), talk(1000, 100), 10, begin_s=0),
        PeerTalk("1000 B at 20 Hz to one, radio", radio(1), talk(1000, 20), 20, begin_s=4,
                 since_s=4),
        PeerTalk("1000 B at 20 Hz to three, radio", radio(2), talk(1000, 20, 3), 20, begin_s=4,
                 since_s=4),
        PeerTalk("100 kB at 2 Hz, radio", radio(3), talk(100_000, 2), 20, begin_s=4, since_s=4),
        _lossy(1000, 10, 0.03, 3), _lossy(1000, 10, 0.1, 3), _lossy(100_000, 1, 0.01, 3),
        *(_cut(seconds, 10, from_s) for seconds, from_s in (
            (5, 12.03), (8, 12.03), (8, 14.03), (15, 12.03), (15, 15.03))),
        leaving(4),
    ),
    "rmw_zenoh": (_cut(15), _cut(60), _cut(60, 0)),
    "peer": (
        *(PeerTalk(f"first 15 s of {hosts} hosts", lan(), fleet(hosts), 15)
          for hosts in (2, 4, 8)),
        PeerTalk("8 hosts at rest for 30 s", lan(), fleet(8), 45, since_s=15.03),
        PeerTalk("1000 B at 20 Hz to three, radio", radio(5), talk(1000, 20, 3), 20, begin_s=4,
                 since_s=4),
        _cut(5), _cut(15), leaving(6),
        PeerTalk("6 hosts on an access point, first 15 s", access_point(0), fleet(6), 15),
    ),
}


def rows() -> Iterator[JudgedRow]:
    """All rows of Zenoh."""
    for timing, talks in ROWS.items():
        for number, row in enumerate(talks):
            yield judged_row(row, software(timing), f"{timing[:3]}{number}")
