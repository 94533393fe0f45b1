"""A recording of ROS as a replayed fleet: the folder of a run that was not simulated."""

from __future__ import annotations

import hashlib
import json
import os
import re
import unicodedata
from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple

import numpy as np
import yaml

from desim.errors import InputError
from desim.files import opened, refuse_link, writing
from desim.imports.recording_content import RecordingContent
from desim.imports.ros_content import read_ros
from desim.imports.run_tables import LOGGED_DROP, ReplayedFleet, Tables, tables
from desim.imports.tum import all_tum, read_tum
from desim.results import identity, parquet
from desim.results.file_names import MANIFEST, NAMES, SCENARIO, SUMMARY
from desim.results.run import Run
from desim.results.seal import Json, seal
from desim.results.status import RunStatus
from desim.scenario.schema.fleet import MAX_ROBOTS
from desim.units import NS_PER_S

_LISTED = 8  # robots, with where their poses come from
_DIGITS = 12  # as of a run's id
_MOST_DAYS, _FARTHEST_M = 31, 2_000_000  # int32 mm
_CHUNK = 1 << 20


class Imported(NamedTuple):
    """A run that was imported, and sentences about what it has and what was left out."""

    run: Run
    notes: list[str]


def import_recording(path: Path, out: Path, name: str | None = None, topic: str | None = None,
                     others: Sequence[Path] = ()) -> Imported:
    """Make a run's folder, ``out/<name>/<id>``, of the trajectories, maps, paths and log of links
    in the MCAP file or bag at ``path``. ``name`` None: as the file is called, in ASCII. ``topic``
    is a pattern for the topics of poses (None: all). ``path`` and ``others`` may be trajectories of
    TUM, of a robot each.

    The manifest's status is ``imported``; such a run can be looked at, not repeated. A file that
    was cut short is read up to there, which the notes say. Raises ``InputError`` for a file that
    cannot be read or has no trajectories, and a folder that cannot be written.
    """
    paths = [path, *others]
    content = read_tum(paths) if all_tum(paths) else read_ros(path, topic)
    _check(path, content)
    fleet = ReplayedFleet(content)
    made = tables(fleet)
    source = path.resolve()
    about: Json = {
        "status": RunStatus.IMPORTED, "digest": None, "seed": None,
        "source": ", ".join(one.resolve().name for one in paths),
        "name": _run_name(name or source.stem), "run_id": _digest(*paths), "events": 0,
        "simulated_s": fleet.end_ns / NS_PER_S, "desim_version": identity.versions()["desim"],
        "broken": content.broken}
    folder = _written(out / about["name"] / about["run_id"], about, made, _scenario(fleet),
                      _summary(about["source"], fleet))
    return Imported(Run(folder), _notes(fleet, made))


def _run_name(text: str) -> str:
    """A run's name in ASCII: letters without their accents, ``_`` for all else between them."""
    bare = "".join(letter for letter in unicodedata.normalize("NFKD", text)
                   if not unicodedata.combining(letter))
    name = re.sub(r"\W", "_", bare, flags=re.ASCII).strip("_")
    return name if name[:1].isalpha() else f"recording_{name}".rstrip("_")


def _check(path: Path, content: RecordingContent) -> None:
    """Refuse what cannot be a recording of one fleet."""
    found, (start_ns, end_ns) = content.tracks, content.span_ns()
    days = (end_ns - start_ns) / (86_400 * NS_PER_S)
    if days > _MOST_DAYS:
        raise InputError(f"{path}: its stamps are {days:.0f} days apart; at most {_MOST_DAYS}: "
                         "some may count from 0, and others from 1970; --topic takes some only")
    farthest_m = max(float(np.abs(track.poses[:, :2]).max()) for track in found.values())
    if farthest_m > _FARTHEST_M:
        raise InputError(f"{path}: its robots are up to {farthest_m:.7g} m from the origin; at "
                         f"most {_FARTHEST_M} m: poses in a local frame are wanted")
    if len(found) > MAX_ROBOTS:
        raise InputError(f"{path}: it has {len(found)} robots; at most {MAX_ROBOTS}; --topic takes "
                         "some only")


def _digest(*paths: Path) -> str:
    """A hash of the files' content, of all files' in a folder."""
    digest = hashlib.sha256()
    for file in sorted(paths[0].rglob("*")) if paths[0].is_dir() else paths:
        if file.is_file():
            with opened(file) as content:
                while part := content.read(_CHUNK):
                    digest.update(part)
    return digest.hexdigest()[:_DIGITS]


def _scenario(fleet: ReplayedFleet) -> Json:
    """The least of a scenario: who is there, and where they start. Nothing else is known."""
    side_m = 2 * float(np.abs(fleet.poses[..., :2]).max()) + 1
    return {"deployment": "field", "network": {"media": {"air": {"model": "disk"}}},
            "environment": {"terrain": {"size": [f"{side_m:.3f} m", f"{side_m:.3f} m"]}},
            "fleet": {"start": {"poses": [
                {"name": robot, "x": f"{x:.3f} m", "y": f"{y:.3f} m", "heading": f"{yaw:.3f} rad"}
                for robot, (x, y, yaw) in zip(fleet.robots, fleet.poses[0].tolist(), strict=True)]},
                "size": len(fleet.robots)},
            "hosts": {host: {} for host in fleet.stations}}


def _summary(source: str, fleet: ReplayedFleet) -> Json:
    """Those metrics that a replay shows; None is unknown."""
    links = fleet.content.links
    delivered, dropped = (sum(one.messages for one in links), sum(one.dropped for one in links))
    return {"imported_from": source, "stop_reason": "imported",
            "simulated_s": fleet.end_ns / NS_PER_S, "exploration_time_s": None, "collisions": None,
            "exploration_cost_m": float(np.hypot(*np.diff(
                fleet.poses[..., :2], axis=0).transpose(2, 0, 1)).sum()),
            "messages_delivered": delivered if delivered or dropped else None,
            "messages_dropped": {LOGGED_DROP: dropped} if dropped else {},
            "partitions": {"count": None, "episodes_s": []}, "warnings": []}


def _written(folder: Path, about: Json, made: Tables, scenario: Json, summary: Json) -> Path:
    """Write the files in a new folder beside its place, and move them into it, the manifest last:
    whatever somebody has put there, nothing is written through a link."""
    with writing(folder, "--out"):
        folder.parent.mkdir(parents=True, exist_ok=True)
        refuse_link(folder)
    with writing(folder, "--out"), TemporaryDirectory(
            dir=folder.parent, prefix=f".{folder.name}.") as temporary:
        partial = Path(temporary)
        for name, table in made.items():
            parquet.write(partial / f"{name}.parquet", table)
        (partial / NAMES).write_text("{}\n", "utf-8")
        (partial / SCENARIO).write_text(yaml.safe_dump(
            {"name": about["name"], "seed": 0, **scenario}, sort_keys=False), "utf-8")
        (partial / SUMMARY).write_text(json.dumps(summary, indent=2) + "\n", "utf-8")
        names = sorted(file.name for file in partial.iterdir())
        seal(partial, about, names)
        folder.mkdir(exist_ok=True)
        for name in [*names, MANIFEST]:
            os.replace(partial / name, folder / name)
    return folder


def _notes(fleet: ReplayedFleet, made: Tables) -> list[str]:
    content, notes = fleet.content, []
    poses = made["poses"].num_rows // len(fleet.robots)
    robots = len(fleet.robots)
    notes.append(f"{robots} robot{'s' * (robots > 1)}, "
                 f"{fleet.end_ns / NS_PER_S:.1f} s, {poses} poses each")
    listed = [f"  {robot}: {track.source}" for robot, track in fleet.tracks.items()]
    notes += listed if len(listed) <= _LISTED else [*listed[:_LISTED - 2], "  ...", listed[-1]]
    mapped, maps = made["growth"].num_rows, len(content.grids)
    if maps:
        notes.append(f"maps of {mapped} robots, of {maps} topics with maps")
    if content.links:
        notes.append(f"{made['links'].num_rows} changes of links, "
                     f"{len(content.links)} entries of their log")
    notes += content.notes
    if content.broken:
        notes.append(f"the file is damaged, and was read as far as it can be: {content.broken}")
    return notes
