"""The events of a run that its replay lists and jumps to, in words."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np

from desim.report.replay.associations import CHANGES
from desim.report.replay.seconds import Seconds
from desim.report.replay.traffic import BornMessages
from desim.results.recording import Event
from desim.robot.navigation.recovery import Recovery
from desim.units import NS_PER_S

# Kinds of events that happen by the thousand: they are drawn, not listed.
_DRAWN = ("advertises", "subscribes", "believes", "sees", "goal", "goal_reached", "localized",
          "believed", "partition")
_RECOVERIES = {Recovery.REPLAN: "plans again", Recovery.ROTATE: "turns",
               Recovery.RETREAT: "backs off",
               Recovery.CONSERVATIVE_RESET: "forgets what is far",
               Recovery.AGGRESSIVE_RESET: "forgets what is near, too"}
_BEGIN = ("host_started", *CHANGES)  # at the start of a run they are no news
_PLAIN = {"host_stopped": "{} stops", "host_started": "{} starts again",
          "access_point_stopped": "{} stops", "access_point_started": "{} starts again",
          "stuck": "{} is stuck", "freed": "{} is free again",
          "goal_aborted": "{} gives up its goal", "stop": "the run ends",
          "stands": "{} stands, and has goals", "drives_again": "{} drives again",
          "map_redrawn": "{} corrects its path, and draws its map anew"}
_FULL = "full"  # in the reasons queue_full, outbox_full, ...
_APART_NS = 10 * NS_PER_S  # late messages and missed ticks that are closer are one episode
MOST = 3000  # events that the page lists


class ListedEvent(NamedTuple):
    """One line of the page's list of events; ``subjects`` are robots, hosts or a topic."""

    time_ns: int
    kind: str
    text: str
    subjects: tuple[str, ...] = ()


def listed_events(events: Iterable[Event], traffic: BornMessages, hosts: Sequence[str],
                  partitions_s: Sequence[Sequence[float]], seconds: Seconds | None = None
                  ) -> tuple[list[ListedEvent], str | None]:
    """All that is listed, by time, and the sentence that says what was left out, if anything
    was. ``seconds``: those of robots whose computers get busy."""
    found = [ListedEvent(event.time_ns, event.kind, _words(event, hosts),
                         (event.entity,) if event.entity in hosts else ())
             for event in events
             if event.kind not in _DRAWN and (event.kind not in _BEGIN or event.time_ns > 0)]
    for begin_s, end_s in partitions_s:
        found.append(ListedEvent(round(begin_s * NS_PER_S), "partition",
                                 f"the fleet is split for {end_s - begin_s:.0f} s"))
        found.append(ListedEvent(round(end_s * NS_PER_S), "partition", "the fleet is whole again"))
    found += _late(traffic, hosts) + _full(traffic, hosts)
    if seconds is not None:
        found += _missed(seconds)
    found.sort(key=lambda one: one.time_ns)
    if len(found) <= MOST:
        return found, None
    kept = np.linspace(0, len(found) - 1, MOST).astype(int)
    return [found[k] for k in kept], f"{MOST:,} of {len(found):,} events are listed, evenly"


def _words(event: Event, hosts: Sequence[str]) -> str:
    values = event.detail.split()
    if event.kind == "collision":
        return f"{event.entity} hits {values[0] if values[0] in hosts else 'a wall'}"
    if event.kind == "recovery":
        return f"{event.entity} {_RECOVERIES[Recovery(int(values[1]))]}"
    if event.kind == "out_of_memory":
        return f"{event.entity} runs out of memory: {values[0]} is killed, the rest dies with it"
    if event.kind in CHANGES:
        verb = "joins" if CHANGES[event.kind] else "leaves"
        return f"{event.entity} {verb} {values[0]}"
    if event.kind == "visit":
        alone_s = int(values[1]) / NS_PER_S
        return f"{event.entity} visits place {values[0]}, alone for {alone_s:.1f} s"
    if event.kind in _PLAIN:
        return _PLAIN[event.kind].format(event.entity)
    while values and values[-1] == "0":  # columns that this kind of row does not use
        values.pop()
    return " ".join([event.entity, event.kind.replace("_", " "), *values])


def _late(traffic: BornMessages, hosts: Sequence[str]) -> list[ListedEvent]:
    """The first late message of each episode, and how many follow it."""
    rows = np.flatnonzero(traffic.is_late)
    rows = rows[np.argsort(traffic.end_ns[rows], kind="stable")]
    out = []
    for begin, end in _episodes(traffic.end_ns[rows]):
        row = rows[begin]
        took_s = (traffic.end_ns[row] - traffic.born_ns[row]) / NS_PER_S
        more = f", {end - begin - 1} more follow" if end - begin > 1 else ""
        source, destination = hosts[traffic.source[row]], hosts[traffic.destination[row]]
        out.append(ListedEvent(
            int(traffic.end_ns[row]), "late", f"{traffic.topics[traffic.topic[row]]} to "
            f"{destination} took {took_s:.1f} s{more}", (source, destination)))
    return out


def _missed(seconds: Seconds) -> list[ListedEvent]:
    """The first ticks of each episode that a robot's timers miss, and how many they are."""
    out = []
    for robot in np.unique(seconds["robot"]):
        own = seconds["robot"] == robot
        missed = np.diff(seconds["missed_ticks"][own], prepend=0)
        rows = np.flatnonzero(missed)
        times_ns = np.rint(seconds["time_s"][own] * NS_PER_S).astype(np.int64)[rows]
        for begin, end in _episodes(times_ns):
            ticks, last_s = missed[rows[begin:end]].sum(), times_ns[end - 1] / NS_PER_S
            out.append(ListedEvent(
                int(times_ns[begin]), "missed_ticks", f"{robot}: busy nodes miss {ticks:,} ticks "
                f"of their timers until {last_s:.0f} s", (str(robot),)))
    return out


def _episodes(times_ns: np.ndarray) -> list[tuple[int, int]]:
    """The first row of each episode of ``times_ns``, ascending, and that behind its last."""
    if not len(times_ns):
        return []
    starts = np.flatnonzero(np.diff(times_ns, prepend=times_ns[0] - 2 * _APART_NS) > _APART_NS)
    return list(zip(starts.tolist(), [*starts[1:].tolist(), len(times_ns)], strict=True))


def _full(traffic: BornMessages, hosts: Sequence[str]) -> list[ListedEvent]:
    """The first message that was dropped for a full queue."""
    full = [k for k, reason in enumerate(traffic.reasons) if _FULL in reason]
    rows = np.flatnonzero(np.isin(traffic.reason, full))
    if not len(rows):
        return []
    row = rows[np.argmin(traffic.end_ns[rows])]
    source, destination = hosts[traffic.source[row]], hosts[traffic.destination[row]]
    return [ListedEvent(int(traffic.end_ns[row]), "saturation",
                        f"first message dropped for a full queue: "
                        f"{traffic.reasons[traffic.reason[row]]}, "
                        f"{traffic.topics[traffic.topic[row]]} to {destination}",
                        (source, destination))]
