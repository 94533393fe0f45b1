"""The story of a message has what its hosts' access points have to do with it."""

import numpy as np

from desim.commands.views.message_rows import story
from desim.engine.trace import ROW, Names

MS = 1_000_000


def trace(*rows):
    """The rows (ms, kind, entity, a, b, c), and the names of their ids."""
    names = Names()
    return np.array([(round(ms * MS), names.id(kind), names.id(entity), *(
        names.id(value) if isinstance(value, str) else value for value in values))
        for ms, kind, entity, *values in rows], ROW), names.items()


def test_who_leaves_and_joins_meanwhile():
    """Neither what other hosts do, nor what happened before or after."""
    rows, names = trace(
        (0, "disassociated", "b", 0, "medium/air", 0),
        (1, "associated", "b", "ap_0", "medium/air", 0),
        (2, "sent", "a", "/map", 7, 100),
        (2, "frame", "a", "b", 7, 150),
        (3, "disassociated", "b", "ap_0", "medium/air", 0),
        (3, "disassociated", "c", "ap_0", "medium/air", 0),
        (4, "associated", "b", "ap_1", "medium/air", 0),
        (5, "disassociated", "a", 0, "medium/air", 0),
        (6, "delivered", "b", "a", 7, 4 * MS),
        (7, "associated", "a", "ap_1", "medium/air", 0))
    assert [(step.time_ns // MS, step.what, step.where, step.detail)
            for step in story(rows, names, 1)] == [
        (2, "sent", "a", "/map, 100 B"),
        (2, "frame", "a", "to b, 150 B with headers"),
        (3, "disassociated", "b", "ap_0"),
        (4, "associated", "b", "ap_1"),
        (5, "disassociated", "a", "no access point"),
        (6, "delivered", "b", "4.000000 ms after it was sent")]
