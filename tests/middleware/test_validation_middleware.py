"""``desim validate --only middleware`` agrees where it is quick to see, and each family has twins:
with one constant of the protocol changed the same rows fail."""

from collections.abc import Callable
from itertools import islice
from typing import NamedTuple

import pytest

from desim.middleware.zenoh import link
from desim.middleware.zenoh.line import Line
from desim.middleware.zenoh.router import Router
from desim.validation import zenoh


class Twin(NamedTuple):
    """Some rows of a family, and what is made wrong."""

    rows: Callable
    wrong: Callable


def longer_keep_alives(monkeypatch):
    monkeypatch.setattr(link, "KEEP_ALIVE_BYTES", 30)


def one_message_for_all_declarations(monkeypatch):
    def opened(router):
        wishes, router._wishes = router._wishes, None
        router.declare([declaration for wish in wishes for declaration in wish])

    monkeypatch.setattr(Router, "_open", opened)


def no_drain(monkeypatch):
    """An end that has expired is gone at once."""
    monkeypatch.setattr(Line, "flush", lambda self, flushed: flushed())


def small_zenoh_fleet():
    return islice(zenoh.discovery(), 1)


def zenoh_near_the_lease():
    return zenoh.heard_again([("zenoh", 8)])


TWINS = [
    Twin(zenoh.at_rest, longer_keep_alives),
    Twin(small_zenoh_fleet, one_message_for_all_declarations),
    Twin(zenoh_near_the_lease, no_drain),
]


@pytest.mark.parametrize("twin", TWINS, ids=lambda twin: twin.wrong.__name__)
def test_rows_agree_and_their_twin_does_not(monkeypatch, twin):
    rows = list(twin.rows())
    assert rows and [check for check in rows if not check.holds] == []
    twin.wrong(monkeypatch)
    assert not all(check.holds for check in twin.rows())
