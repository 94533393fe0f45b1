"""The rows of TCP in ``desim validate --only middleware``: a few that are quick.

Each has a twin in which a constant or a mechanism of TCP is wrong.
"""

from collections.abc import Callable
from typing import NamedTuple

import pytest

from desim.middleware.tcp.cubic import Cubic
from desim.middleware.tcp.receiver import Receiver
from desim.middleware.tcp.retransmission import RetransmissionTimer
from desim.middleware.tcp.scoreboard import Scoreboard
from desim.middleware.tcp.sender import Sender
from desim.middleware.tcp.window import CongestionWindow
from desim.validation import tcp


class Twin(NamedTuple):
    """Some rows, and what is made wrong."""

    rows: Callable
    wrong: Callable


def delayed_acknowledgements(monkeypatch):
    """Acknowledgements wait as RFC 1122 lets them, also where both ends answer."""
    monkeypatch.setattr(Receiver, "pingpong", property(lambda receiver: True,
                                                       lambda receiver, answers: None))


def longer_timeouts(monkeypatch):
    """By 8 %."""
    sample = CongestionWindow.sample

    def slower(window, rtt_ns, now_ns):
        sample(window, rtt_ns, now_ns)
        window.rto_ns = window.rto_ns * 108 // 100

    monkeypatch.setattr(CongestionWindow, "sample", slower)


def no_word_of_addresses(monkeypatch):
    """RFC 6069 is unknown."""
    monkeypatch.setattr(RetransmissionTimer, "unresolved", lambda retransmission, start: None)


def half_the_window(monkeypatch):
    """Reno's loss in place of CUBIC's."""
    monkeypatch.setattr(Cubic, "recalc_ssthresh", lambda cubic, window: max(window // 2, 2))


def no_selective_acknowledgements(monkeypatch):
    acknowledge = Scoreboard.acknowledge
    monkeypatch.setattr(Scoreboard, "acknowledge", lambda board, una, ranges, *rest: acknowledge(
        board, una, (), *rest))


def nagle_anyway(monkeypatch):
    """Small messages wait for those before them."""
    monkeypatch.setattr(Sender, "nodelay", property(lambda sender: False,
                                                    lambda sender, nodelay: None))


def no_nagle(monkeypatch):
    """Small messages wait for none before them."""
    monkeypatch.setattr(Sender, "nodelay", property(lambda sender: True,
                                                    lambda sender, nodelay: None))


TWINS = [
    Twin(tcp.nagle, delayed_acknowledgements),
    Twin(lambda: tcp.cuts(tcp.CUTS[1:2]), longer_timeouts),
    Twin(lambda: tcp.cuts(tcp.CUTS[11:12]), no_word_of_addresses),
    Twin(lambda: tcp.bulk(tcp.BUSY[1:2], seeds=2, seconds=60), half_the_window),
    Twin(lambda: tcp.lossy(tcp.PROMPT[1:2], seeds=3), nagle_anyway),
    Twin(lambda: tcp.lossy(tcp.LOSSY[2:3], seeds=1), no_selective_acknowledgements),
    Twin(lambda: tcp.lossy(tcp.LOSSY[6:7], seeds=9), no_nagle),
    Twin(lambda: tcp.lossy(tcp.PROMPT[5:6], seeds=5), no_selective_acknowledgements),
    Twin(lambda: tcp.lossy(tcp.PROMPT[6:7], seeds=5), no_selective_acknowledgements),
    Twin(lambda: tcp.lossy(tcp.PROMPT[7:8], seeds=9), half_the_window),
    Twin(lambda: tcp.lossy(tcp.PROMPT[8:9], seeds=9), half_the_window),
]


@pytest.mark.parametrize("twin", TWINS, ids=lambda twin: twin.wrong.__name__)
def test_rows_agree_and_their_twin_does_not(monkeypatch, twin):
    rows = list(twin.rows())
    assert rows and [check for check in rows if not check.holds] == []
    twin.wrong(monkeypatch)
    assert not all(check.holds for check in twin.rows())
