"""The loads of links in a replay: bytes by link, kind and bin of time, for few links and many."""

import numpy as np
import pytest

from desim.report.replay import traffic
from desim.report.replay.traffic import BornMessages, add_loads, add_messages

S = 10**9
NAMES = ("load.bin", "load.source", "load.destination", "load.kind", "load.bytes")


def messages(*rows):
    """Messages of 100 B more each, by source, destination and the second of their end; those to
    nobody (-1) were dropped."""
    source, destination, end_s = np.array(rows).T
    none = np.zeros(len(rows), int)
    return BornMessages(("/map",), ("/map",), np.array([1]), none[:1], ("delivered", "outage"),
                        none, none, source, destination.clip(0), 100 * (1 + np.arange(len(rows))),
                        none, none, end_s * S, (destination < 0).astype(int))


class Kept(dict):
    def add(self, name, values):
        self[name] = np.asarray(values).tolist()


def loads(*rows):
    columns = Kept()
    said = add_loads(columns, messages(*rows))
    return sorted(zip(*(columns[name] for name in NAMES), strict=True)), said


def test_bytes_of_a_second_are_summed_by_link_and_dropped_ones_do_not_count():
    assert loads((0, 1, 0), (0, 1, 0), (1, 0, 0), (0, 1, 3), (0, -1, 3)) == (
        [(0, 0, 1, 1, 300), (0, 1, 0, 1, 300), (3, 0, 1, 1, 400)], (1, []))


@pytest.mark.parametrize(("most", "width_s", "bins", "notes"), [
    (4, 1, [0, 1, 2, 3], []), (3, 2, [0, 1], ["loads of links are means over 2 s"]),
    (2, 2, [0, 1], ["loads of links are means over 2 s"]),
    (1, 4, [0], ["loads of links are means over 4 s"])])
def test_too_many_bins_are_summed_over_longer_times(monkeypatch, most, width_s, bins, notes):
    monkeypatch.setattr(traffic, "MAX_LOADS", most)
    monkeypatch.setattr(traffic, "_busiest",
                        lambda links, sizes: (np.ones(len(sizes), bool), []))
    found, said = loads((0, 1, 0), (0, 1, 1), (0, 1, 2), (0, 1, 3))
    assert ([row[0] for row in found], said) == (bins, (width_s, notes))
    assert sum(row[-1] for row in found) == 1000


def test_of_many_links_the_busiest_have_loads(monkeypatch):
    monkeypatch.setattr(traffic, "MAX_LOADS", 8)
    assert loads((0, 1, 0), (1, 2, 0), (2, 0, 0)) == (
        [(0, 1, 2, 1, 200), (0, 2, 0, 1, 300)],
        (1, ["only the 2 busiest of 3 links have loads"]))
    assert loads((0, 1, 0), (1, 2, 0))[1] == (1, [])


@pytest.mark.parametrize(("rows", "kept"), [
    ([(0, 1, 0.0)] * 4, [0, 1, 2, 3]), ([(0, 1, 0.0)] * 10, [0, 3, 6, 9]),
    ([(0, 1, 0.0)] * 4 + [(0, 1, 9.0)] + [(0, 1, 0.0)] * 5, [0, 4, 5, 9]),
    ([(0, 1, 0.0)] * 4 + [(0, -1, 0.0)] + [(0, 1, 0.0)] * 5, [0, 4, 5, 9])])
def test_of_many_messages_late_and_lost_ones_are_drawn_and_others_evenly(monkeypatch, rows, kept):
    monkeypatch.setattr(traffic, "MAX_MESSAGES", 4)
    drawn, note = add_messages(Kept(), messages(*rows))
    assert drawn.tolist() == kept
    assert (note is None) == (len(kept) == len(rows))
