"""``desim validate --only middleware`` agrees where it is quick to see, and each family has twins:
with one constant of the protocol changed the same rows fail."""

from collections.abc import Callable
from typing import NamedTuple

import pytest

from desim.middleware.zenoh import link
from desim.validation import zenoh


class Twin(NamedTuple):
    """Some rows of a family, and what is made wrong."""

    rows: Callable
    wrong: Callable


def longer_keep_alives(monkeypatch):
    monkeypatch.setattr(link, "KEEP_ALIVE_BYTES", 30)


TWINS = [
    Twin(zenoh.at_rest, longer_keep_alives),
]


@pytest.mark.parametrize("twin", TWINS, ids=lambda twin: twin.wrong.__name__)
def test_rows_agree_and_their_twin_does_not(monkeypatch, twin):
    rows = list(twin.rows())
    assert rows and [check for check in rows if not check.holds] == []
    twin.wrong(monkeypatch)
    assert not all(check.holds for check in twin.rows())
