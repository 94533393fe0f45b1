"""All that the replay page has of one run: a description, and columns of numbers."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from desim.report.replay.associations import add_associations
from desim.report.replay.beliefs import add_beliefs
from desim.report.replay.columns import Columns
from desim.report.replay.events import listed_events
from desim.report.replay.facts import facts
from desim.report.replay.growth import add_growth
from desim.report.replay.ledger import add_ledger
from desim.report.replay.seconds import add_computers, add_seconds, seconds_of
from desim.report.replay.sensors import add_bumps, sensors_of
from desim.report.replay.traffic import add_loads, add_messages, add_topics, traffic_of
from desim.results.file_names import LEDGER, SUMMARY
from desim.results.source import ReplaySource
from desim.results.status import is_imported
from desim.scenario.robot_types import types_of

Description = dict[str, object]  # what JSON can hold
PLANS = ("plan", "goal", "frontiers", "path", "pose")  # others are marks, with words
MAX_PLAN_POINTS = 1_500_000


def bundle(recording: ReplaySource) -> tuple[Description, Columns]:
    """The description of a run and its columns; ``assets/data/run.js`` reads them.

    Times are nanoseconds where exactness shows (poses), else microseconds; lengths are mm."""
    run, columns = recording.run, Columns()
    scenario, manifest = run.scenario, run.manifest
    metrics = run.metrics if run.has(SUMMARY) else {}  # a failed run has none
    hosts = [host.name for host in recording.hosts]
    traffic = traffic_of(recording.messages, hosts)
    notes = []
    _add_poses(columns, recording)
    grown, reduced = add_growth(columns, recording.growths, recording.robots)
    notes.append(reduced)
    notes += _imported(recording) if is_imported(manifest) else []
    drawn, reduced = add_messages(columns, traffic)
    notes.append(reduced)
    ledger = (add_ledger(columns, run.ledger, traffic, drawn, hosts)
              if run.has(LEDGER) else None)
    load_s, reductions = add_loads(columns, traffic)
    notes += reductions
    add_topics(columns, traffic, recording.begin_ns, recording.end_ns)
    shown, reduced = _add_plans(columns, recording, hosts)
    notes.append(reduced)
    _add_links(columns, recording)
    add_beliefs(columns, recording.events, hosts)
    access_points = metrics.get("access_points", [])
    stations = add_associations(columns, recording.events, hosts, access_points)
    sensors = sensors_of(recording)
    add_bumps(columns, recording, sensors["bumpers"] or ())
    seconds = seconds_of(recording)
    add_seconds(columns, seconds, len(recording.robots))
    computers = add_computers(columns, seconds, recording)
    partitions_s = metrics.get("partitions", {}).get("episodes_s", [])
    listed, reduced = listed_events(recording.events, traffic, hosts, partitions_s,
                                    seconds if computers and not recording.begin_ns else None)
    notes.append(reduced)
    about: Description = {
        "name": manifest["name"], "seed": manifest["seed"],
        "digest": manifest["digest"], "status": manifest["status"],
        "run_id": manifest["run_id"], "error": manifest.get("error"),
        "stop_reason": metrics.get("stop_reason"), "version": manifest["desim_version"],
        "start_ns": recording.begin_ns, "end_ns": recording.end_ns,
        "facts": facts(scenario, metrics, len(recording.robots)),
        "robots": list(recording.robots), "hosts": hosts,
        "places": {host.name: [host.x_m, host.y_m] for host in recording.hosts
                   if not math.isnan(host.x_m)},
        "access_points": access_points, "stations": stations,
        "radius_m": [body.radius_m for body in types_of(scenario.fleet)],
        "footprints": [body.corners_m or None for body in types_of(scenario.fleet)],
        **sensors, "computers": computers,
        "deployment": scenario.deployment, "middleware": scenario.middleware.model,
        "terrain": _add_terrain(columns, recording),
        "lives": [[recording.robots.index(life.robot), life.started_ns, life.until_ns]
                  for life in recording.lives],
        "growth": grown, "load_s": load_s, "plan_kinds": shown[0], "marks": shown[1],
        "topics": list(traffic.topics), "families": list(traffic.families),
        "topic_family": traffic.family.tolist(), "topic_kind": traffic.kind.tolist(),
        "reasons": list(traffic.reasons), "ledger": ledger, "partitions_s": partitions_s,
        "events": [[one.time_ns, one.kind, one.text, list(one.subjects)] for one in listed],
        "notes": [note for note in notes if note]}
    return about, columns


def _imported(recording: ReplaySource) -> list[str]:
    """Sentences about what an imported run has not."""
    notes = ["it was imported: only what was recorded is shown, no laser scans and no beliefs"]
    if recording.growths:
        notes.append("maps grow in the recording's steps; ground that several robots' maps gain in "
                     "one step has the first of these robots' colour in the merged map")
    return notes


def _add_poses(columns: Columns, recording: ReplaySource) -> None:
    poses = recording.poses
    columns.add("pose.ns", poses.times_ns)
    columns.add("pose.x_mm", poses.xy_mm[:, :, 0].T)
    columns.add("pose.y_mm", poses.xy_mm[:, :, 1].T)
    columns.add("pose.yaw_mrad", poses.yaw_mrad.T)
    moving = recording.moving_obstacles
    for k, name in enumerate(("x_mm", "y_mm", "radius_mm")):
        columns.add(f"obstacle.{name}", moving[:, :, k].T)


def _add_plans(columns: Columns, recording: ReplaySource, hosts: Sequence[str]
               ) -> tuple[tuple[list[str], list[str]], str | None]:
    """Add what hosts have shown. The names of its kinds, ``PLANS`` first, and all words of marks;
    what was left out."""
    plans = recording.plans
    kinds = [*PLANS, *sorted({plan.kind for plan in plans}.difference(PLANS))]
    place, number = {name: i for i, name in enumerate(hosts)}, {"": 0}
    lengths = [len(plan.xy_mm) for plan in plans if not plan.texts]
    every = -(-sum(lengths) // MAX_PLAN_POINTS) or 1
    points = [plan.xy_mm if plan.texts else _every(plan.xy_mm, every) for plan in plans]
    texts = [number.setdefault(text, len(number)) for plan, own in zip(plans, points, strict=True)
             for text in plan.texts or [""] * len(own)]
    columns.add("plan.ns", np.array([plan.time_ns for plan in plans], np.int64))
    columns.add("plan.host", np.array([place[plan.robot] for plan in plans], np.int64))
    columns.add("plan.kind", np.array([kinds.index(plan.kind) for plan in plans], np.int64))
    columns.add("plan.count", np.array([len(own) for own in points], np.int64))
    whole = np.concatenate([np.empty((0, 2), np.int64), *points])
    columns.add("plan.x_mm", whole[:, 0])
    columns.add("plan.y_mm", whole[:, 1])
    columns.add("plan.text", np.array(texts, np.int64))
    return ((kinds, list(number)),
            None if every == 1 else f"plans are drawn through one point in {every}")


def _every(points: np.ndarray, step: int) -> np.ndarray:
    """One point in ``step``, and the last."""
    if step == 1 or len(points) < 3:
        return points
    return points[np.unique(np.append(np.arange(0, len(points), step), len(points) - 1))]


def _add_links(columns: Columns, recording: ReplaySource) -> None:
    place = {host.name: i for i, host in enumerate(recording.hosts)}
    rows = np.array([(change.time_ns, place[change.host], place[change.other], change.linked)
                     for change in recording.links
                     if change.host in place and change.other in place], np.int64).reshape(-1, 4)
    for name, values in zip(("ns", "host", "other", "linked"), rows.T, strict=True):
        columns.add(f"link.{name}", values)


def _add_terrain(columns: Columns, recording: ReplaySource) -> Description:
    walls = recording.walls
    materials = sorted({wall.material for wall in walls})
    corners = np.array([wall[2:6] for wall in walls], np.int64).reshape(-1, 4)
    columns.add("wall.corners_mm", corners.T)
    columns.add("wall.material", np.array([materials.index(wall.material) for wall in walls], int))
    for name in ("height_mm", "from_ns", "until_ns"):
        columns.add(f"wall.{name}", np.array([getattr(wall, name) for wall in walls], np.int64))
    return {"materials": materials}
