"""The beliefs of a run's hosts for its replay: who takes whom for online."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from desim.report.replay.columns import Columns
from desim.results.recording import Event

_STATES = ("never", "online", "offline", "removed")


def add_beliefs(columns: Columns, events: Iterable[Event], hosts: Sequence[str]) -> None:
    """Add the changes of ``sees``: who takes whom for online (1), offline (2), removed (3)."""
    place = {name: i for i, name in enumerate(hosts)}
    rows = []
    for event in events:
        if event.kind == "sees" and event.entity in place:
            words = event.detail.split()
            other = next((place[word] for word in words if word in place), None)
            state = next((k for k, word in enumerate(_STATES) if word in words), None)
            if other is not None and state is not None:
                rows.append((event.time_ns, place[event.entity], other, state))
    table = np.array(rows, np.int64).reshape(-1, 4)
    for name, values in zip(("ns", "believer", "other", "state"), table.T, strict=True):
        columns.add(f"sees.{name}", values)
