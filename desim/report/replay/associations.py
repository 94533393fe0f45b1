"""The associations of hosts with access points, for the replay of a run."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

import numpy as np

from desim.report.replay.columns import Columns
from desim.results.recording import Event

CHANGES = {"associated": 1, "disassociated": 0}  # kinds of rows, and whether a host hangs then


def add_associations(columns: Columns, events: Iterable[Event], hosts: Sequence[str],
                     access_points: Sequence[Mapping[str, object]]) -> list[int]:
    """Add when which host (a number) came to which access point (a number) or left it. Returns the
    hosts that may hang on one."""
    place = {name: i for i, name in enumerate(hosts)}
    number = {(one["medium"], one["name"]): k for k, one in enumerate(access_points)}
    rows, stations = [], set()
    for event in events:
        if event.kind in CHANGES and event.entity in place:
            name, medium, _ = event.detail.split()
            stations.add(place[event.entity])
            which = number.get((medium.partition("/")[2], name))
            if which is not None:  # in the beginning a host may hang on none
                rows.append((event.time_ns, place[event.entity], which, CHANGES[event.kind]))
    table = np.array(rows, np.int64).reshape(-1, 4)
    for name, values in zip(("ns", "host", "access_point", "hangs"), table.T, strict=True):
        columns.add(f"association.{name}", values)
    return sorted(stations)
