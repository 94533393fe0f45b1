"""``desim validate --only fq_codel`` agrees where it is quick to see, and has twins."""

import pytest

from desim.validation import fq_codel
from netmodels.infrastructure.fq_codel import _Flow

SLOW = [row for row in fq_codel.bottlenecks() if row.rate_mbps < 50]
BUSY = [row for row in SLOW if row.traffic == "tcp" and row.offset_ms == 0]


def test_busy_flows_and_floods():
    checks = [*fq_codel.beside(BUSY[1:]), *fq_codel.beside(
        row for row in SLOW if row.traffic == "flood" and row.target_ms == 5)]
    assert len(checks) > 15 and all(check.holds for check in checks)


def longer(part, target=1, interval=1):
    """A queue whose constants are so many of its parts."""
    init = _Flow.__init__
    return lambda flow, target_ns, interval_ns, spare_bytes: init(
        flow, target_ns * target // part, interval_ns * interval // part, spare_bytes)


def longer_targets(monkeypatch):
    """A third."""
    monkeypatch.setattr(_Flow, "__init__", longer(3, 4, 3))


def longer_intervals(monkeypatch):
    """A tenth."""
    monkeypatch.setattr(_Flow, "__init__", longer(10, 10, 11))


@pytest.mark.parametrize(("rows", "wrong"), [
    (BUSY[:1], longer_targets), ([row for row in SLOW if row.traffic == "flood"][:1],
                                     longer_intervals)])
def test_the_twins(rows, wrong, monkeypatch):
    wrong(monkeypatch)
    assert not all(check.holds for check in fq_codel.beside(rows))
