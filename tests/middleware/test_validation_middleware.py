"""``desim validate --only middleware`` agrees where it is quick to see, and each family has twins:
with one constant of the protocol changed the same rows fail."""

from collections.abc import Callable
from itertools import islice
from typing import NamedTuple

import pytest

from desim.middleware.multimaster.sync import Sync
from desim.middleware.ros import processes
from desim.middleware.ros.looper import Looper
from desim.middleware.zenoh import link
from desim.middleware.zenoh import zenoh as zenoh_model
from desim.middleware.zenoh.line import Line
from desim.validation import multimaster, ros1, zenoh


class Twin(NamedTuple):
    """Some rows of a family, and what is made wrong."""

    rows: Callable
    wrong: Callable


def no_checksums(monkeypatch):
    """As multimaster_fkie before it asked for them."""
    monkeypatch.setattr(Sync, "_ask", lambda sync, method, remote, count, done: done(True, None))


def no_rounds(monkeypatch):
    """Answers are noticed at once."""
    monkeypatch.setattr(Looper, "looks", lambda looper, now_ns: now_ns)


def no_questions(monkeypatch):
    """Subscriptions are registered at once."""
    schedules = processes.schedules
    monkeypatch.setattr(processes, "schedules", lambda params: schedules(params)._replace(asks=0))


def longer_keep_alives(monkeypatch):
    monkeypatch.setattr(link, "KEEP_ALIVE_BYTES", 30)


def short_tokens(monkeypatch):
    """Names of topics, and nothing else."""
    monkeypatch.setattr(zenoh_model, "token_bytes", lambda node, topic: 15 + len(topic))


def no_drain(monkeypatch):
    """An end that has expired is gone at once."""
    monkeypatch.setattr(Line, "flush", lambda self, flushed: flushed())


def small_zenoh_fleet():
    return islice(zenoh.discovery(), 1)


def zenoh_near_the_lease():
    return zenoh.heard_again([("zenoh", 8)])


TWINS = [
    Twin(multimaster.discovery, no_checksums),
    Twin(ros1.first_messages, no_rounds),
    Twin(ros1.first_messages, no_questions),
    Twin(zenoh.at_rest, longer_keep_alives),
    Twin(small_zenoh_fleet, short_tokens),
    Twin(zenoh_near_the_lease, no_drain),
]


@pytest.mark.parametrize("twin", TWINS, ids=lambda twin: twin.wrong.__name__)
def test_rows_agree_and_their_twin_does_not(monkeypatch, twin):
    rows = list(twin.rows())
    assert rows and [check for check in rows if not check.holds] == []
    twin.wrong(monkeypatch)
    assert not all(check.holds for check in twin.rows())
