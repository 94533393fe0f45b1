"""Folders of runs and campaigns as an attacker would make them, with right seals.

Each function changes a good run's folder. ``hostile`` plays one of them by its number, in the same
way each time. All commands read what it leaves, under an audit:

    HOSTILE_FOLDERS=200 pytest tests/commands/test_hostile_folders.py -k test_hostile_folders
"""

from __future__ import annotations

import json
import os
import random
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq

from desim.results.file_names import MANIFEST, SCENARIO, SUMMARY, WRITTEN
from desim.results.seal import seal
from desim.scenario import yaml12

EVIL = "evil"  # the module in the folder; what it does when it runs: MARK
MARK = "evil_code_ran"
_MODULE = f"""
import pathlib
pathlib.Path(__file__).with_name({MARK!r}).write_text("")
class Evil: pass
def evil(*_): return False
"""
# Where a scenario names code, as paths of keys.
CODE = [("coordination", "strategy"), ("physics", "model"), ("middleware", "model"),
        ("robot", "localization", "model"), ("coordination", "exchange", "model"),
        ("task", "model"), ("stop", "when"), ("computers", "model"),
        ("network", "media", "*", "model"), ("network", "media", "*", "rules")]
NAMES = ["../../victim.txt", "../victim.txt", "/etc/hostname", "map/../../victim.txt", "", ".",
         "..", "map/../manifest.json", "a\0b", "\x1b[31mred", "x" * 5000, "deep/er/name",
         "victim.parquet"]
VALUES = [None, True, -1, 10**30, 1.5, "", "x", "\x1b[31m", [], {}, [[]], {"a": 1}, "9" * 50,
          "../../x", "/dev/zero", 1e308, "x" * 5000]


def hostile(run: Path, number: int) -> str:
    """Change the run's folder as the attack of this number does; returns its name."""
    stream = random.Random(f"hostile {number}")
    attack = ATTACKS[number % len(ATTACKS)]
    attack(run, stream)
    return attack.__name__


def resealed(run: Path, change: Callable[[dict[str, Any]], None] = lambda _: None) -> None:
    """Seal the folder as it is now; ``change`` gets the manifest, then with a right seal, too."""
    manifest = json.loads((run / MANIFEST).read_text())
    names = [name for name in manifest.pop("files") if _is_file(run / name)]
    manifest.pop("seal")
    change(manifest)
    extra = manifest.pop("files", {})
    seal(run, manifest, names)
    if extra:
        _with_files(run, extra)


def _with_files(run: Path, extra: Any) -> None:
    """Write a manifest whose ``files`` have more, or are something else."""
    from desim.results.seal import _sealed

    whole = json.loads((run / MANIFEST).read_text())
    whole.pop("seal")
    whole["files"] = {**whole["files"], **extra} if isinstance(extra, dict) else extra
    (run / MANIFEST).write_text(json.dumps({**whole, "seal": _sealed(whole)}))


def _is_file(path: Path) -> bool:
    return path.is_file() and not path.is_symlink()


def evil_module(run: Path, stream: random.Random) -> None:
    """The scenario names a module in the folder; nothing was kept, so that it would be made again.
    """
    set_code(run, stream.choice(CODE))


def set_code(run: Path, keys: tuple[str, ...]) -> None:
    """Let ``keys`` of the scenario name the evil module, and keep nothing of what happened."""
    (run / f"{EVIL}.py").write_text(_MODULE)
    scenario = yaml12.read(str(run / SCENARIO))[0]
    block = scenario
    for key in keys[:-1]:
        if key == "*":
            key = next(iter(block))
        if not isinstance(block.get(key), dict):
            block[key] = {}
        block = block[key]
    name = f"{run}/{EVIL}:{'evil' if keys == ('stop', 'when') else 'Evil'}"
    block[keys[-1]] = [{"rule": name}] if keys[-1] == "rules" else name
    (run / SCENARIO).write_text(yaml12.dump(scenario))
    for table in run.glob("*.parquet"):
        table.unlink()
    resealed(run)


def evil_names(run: Path, stream: random.Random) -> None:
    """The manifest lists files outside of the folder."""
    name = stream.choice(NAMES)
    resealed(run, lambda manifest: manifest.update(files={name: {"bytes": 1, "sha256": "x"}}))


def evil_manifest(run: Path, stream: random.Random) -> None:
    """A value of the manifest is something else."""
    key = stream.choice(sorted(json.loads((run / MANIFEST).read_text()).keys() - {"seal"}))
    value = stream.choice(VALUES)
    if key == "files":
        _with_files(run, stream.choice([[], "x", 1, {"summary.json": 1}, {"map": {}}]))
    else:
        resealed(run, lambda manifest: manifest.update({key: value}))


def links(run: Path, stream: random.Random) -> None:
    """A file is a link, a pipe or a device's name."""
    path = run / stream.choice([*WRITTEN, "replay.html", "figure.png", "map"])
    if path.is_dir():
        path.rename(run / "elsewhere")
    elif os.path.lexists(path):
        path.unlink()
    target = stream.choice(["/dev/zero", "../../victim.txt", "pipe", str(run), "/proc/self/mem"])
    if target == "pipe":
        os.mkfifo(path)
    else:
        path.symlink_to(target)


def other_tables(run: Path, stream: random.Random) -> None:
    """A table has other columns, or other types, or nothing."""
    path = stream.choice(sorted(run.glob("*.parquet")))
    table = pq.read_table(path)
    column = stream.choice(table.column_names)
    how = stream.randrange(5)
    if how == 0:
        table = table.drop_columns([column])
    elif how == 1:
        table = table.drop_columns([column]).append_column(
            column, pa.array([stream.choice(["x", "\x1b[31m"])] * len(table)))
    elif how == 2:
        table = table.slice(0, len(table) // 2 + 1) if len(table) else table
    elif how == 3:
        table = table.drop_columns([column]).append_column(
            column, pa.array([2**62] * len(table), pa.int64()))
    else:
        table = pa.table({"x": pa.array([None] * 3)})
    pq.write_table(table, path)
    resealed(run)


def bombs(run: Path, stream: random.Random) -> None:
    """A small file would take gigabytes."""
    how = stream.randrange(3)
    if how == 0:
        path = stream.choice(sorted(run.glob("*.parquet")))
        zeros = pa.DictionaryArray.from_arrays(pa.array([0] * 1_000_000, pa.int32()), ["x" * 10])
        batch = pa.table({"a": zeros})
        with pq.ParquetWriter(path, batch.schema, compression="zstd") as writer:
            for _ in range(200):
                writer.write_table(batch)
    elif how == 1:
        with open(run / SUMMARY, "r+b") as file:
            file.truncate(10**9)
        _with_files(run, {SUMMARY: {"bytes": 10**9, "sha256": "0" * 16}})
        return
    else:
        (run / SUMMARY).write_text("[" * 1_000_000)
    resealed(run)


def other_texts(run: Path, stream: random.Random) -> None:
    """A value of the summary or the scenario is something else."""
    if stream.random() < 0.5:
        summary = json.loads((run / SUMMARY).read_text())
        key = stream.choice(sorted(summary))
        (run / SUMMARY).write_text(json.dumps(stream.choice([
            {**summary, key: stream.choice(VALUES)}, [], None, {}])))
    else:
        scenario = yaml12.read(str(run / SCENARIO))[0]
        key = stream.choice(sorted(scenario))
        scenario[key] = stream.choice(VALUES)
        (run / SCENARIO).write_text(yaml12.dump(scenario))
    resealed(run)


ATTACKS: list[Callable[[Path, random.Random], None]] = [
    evil_module, evil_names, evil_manifest, links, other_tables, bombs, other_texts]
