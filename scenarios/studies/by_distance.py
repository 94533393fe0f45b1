"""How many messages between robots arrive, by the robots' distance at publication?

    python scenarios/studies/by_distance.py RUN...

The runs, with ``trace.keep`` ``messages`` or ``all``, are taken together. Each row has the share of
all messages, the share of those that were delivered, and the median delay of these.
"""

from __future__ import annotations

import sys

import numpy as np

import desim

EDGES_M = (0, 5, 10, 15, 20, 25, 30, np.inf)
EARLY_S, NEAR_M = 20, 10  # the beginning, when all robots are in one place


def messages_of(run: desim.Run) -> np.ndarray:
    """[messages, 4]: when published in s, distance in m, 1 if delivered, delay in s or NaN."""
    robots, sent = run.robots, run.table("messages")
    at = {name: robots["robot"] == name for name in set(robots["robot"])}
    between = np.isin(sent["source"], list(at)) & np.isin(sent["destination"], list(at))
    born_s = sent["born_ns"][between] / 1e9
    ends = [_places(robots, at, sent[end][between], born_s) for end in ("source", "destination")]
    return np.column_stack([born_s, np.hypot(*(ends[0] - ends[1]).T),
                            sent["fate"][between] == "delivered",
                            sent["latency_ns"][between] / 1e9])


def _places(robots, at, names, when_s) -> np.ndarray:
    """[messages, 2] m: where the robots of ``names`` were, between the seconds of the table."""
    places = np.empty((len(names), 2))
    for name in set(names):
        rows, mine = at[name], names == name
        for axis, column in enumerate(("x_m", "y_m")):
            places[mine, axis] = np.interp(when_s[mine], robots["time_s"][rows],
                                           robots[column][rows])
    return places


def row(what: str, chosen: np.ndarray, of: int) -> str:
    delivered = chosen[:, 2] == 1
    delay = f"{np.median(chosen[delivered, 3]):.1f} s" if delivered.any() else ""
    return (f"| {what} | {100 * len(chosen) / of:.0f} % | {100 * delivered.mean():.2g} % "
            f"| {delay} |")


def main(paths: list[str]) -> None:
    found = np.concatenate([messages_of(desim.Run(path)) for path in paths])
    print("| distance | share of the messages | delivered | median delay |\n|---|---|---|---|")
    for low, high in zip(EDGES_M, EDGES_M[1:], strict=False):
        name = f"over {low} m" if np.isinf(high) else f"{low} to {high} m"
        print(row(name, found[(found[:, 1] >= low) & (found[:, 1] < high)], len(found)))
    early = found[(found[:, 0] < EARLY_S) & (found[:, 1] < NEAR_M)]
    print(row(f"within {NEAR_M} m, first {EARLY_S} s", early, len(found)))


if __name__ == "__main__":
    main(sys.argv[1:])
