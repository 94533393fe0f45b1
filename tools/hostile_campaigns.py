"""Folders of campaigns as an attacker would make them.

Each function changes a good campaign's folder. ``hostile`` plays one of them by its number, in the
same way each time.
"""

from __future__ import annotations

import json
import os
import random
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import hostile_folders
import pyarrow as pa
import pyarrow.parquet as pq
import yaml
from hostile_folders import VALUES

from desim.campaign.folder import index
from desim.campaign.folder.table import RAISED, REFERENCE
from desim.results.file_names import SUMMARY

DESIGN, TABLE, INDEX, RUNS = "design.yaml", "runs.parquet", "index.jsonl", "runs"
# What a page must show as text: ``guarded.py`` looks for the element and the script.
MARKUP = "\"'></title></style></script></svg><script>evil()</script><evil onerror=evil()>"
TEXTS = ["", MARKUP, "\x1b[31mred\x1b]0;x\a", "x" * 3_000_000, "../../victim.txt", "/dev/zero",
         "..", "a\0b", "a\nb", "$\\frac{", "\u202eright", "{0.__class__}", "${title}", "-->",
         "-inf", "nan", "run.py:evil", "evil:Evil"]
_MODULE = f"""
import pathlib
pathlib.Path(__file__).with_name({hostile_folders.MARK!r}).write_text("")
def evil(*_): return 1.0
class Evil: pass
"""


def hostile(campaign: Path, number: int) -> str:
    """Change the campaign's folder as the attack of this number does; returns its name."""
    stream = random.Random(f"hostile campaign {number}")
    attack = ATTACKS[number % len(ATTACKS)]
    attack(campaign, stream)
    return attack.__name__


def other_columns(campaign: Path, stream: random.Random) -> None:
    """A column of the table is gone, or of another type, or has other values."""
    table = pq.read_table(campaign / TABLE)
    name = stream.choice(table.column_names if stream.random() < 0.5 else [
        "run_id", "vector", "iteration", "seed", "status", "robots", "rate_bps", "explored",
        "censored", "stop_reason"])
    count = len(table)
    kinds: list[Callable[[], pa.Array]] = [
        lambda: pa.array([stream.choice(TEXTS)] * count),
        lambda: pa.array([stream.choice([2**63 - 1, -2**63, -1, 0])] * count),
        lambda: pa.array([stream.choice([float("nan"), float("inf"), 1e308, -1e-320])] * count),
        lambda: pa.array([None] * count), lambda: pa.array([[1, 2]] * count),
        lambda: pa.array([{"a": 1}] * count), lambda: pa.array([b"\xff\xfe"] * count),
        lambda: pa.array([True] * count), lambda: pa.array([0] * count, pa.timestamp("ns")),
        lambda: pa.array([0] * count, pa.duration("ns")),
        lambda: pa.array(["x"] * count).dictionary_encode(),
        lambda: pa.array([1] * count, pa.decimal128(38, 3)),
        lambda: pa.array(range(count), pa.uint64()), lambda: pa.array([1.5] * count, pa.float32()),
        lambda: pa.array(["x", *[None] * (count - 1)]),
        lambda: pa.array([2**62 + n for n in range(count)])]
    if name in table.column_names:
        table = table.drop_columns([name])
    if stream.random() < 0.9:
        table = table.append_column(name, stream.choice(kinds)())
    _put(campaign, table)


def other_names(campaign: Path, stream: random.Random) -> None:
    """Columns, and what the design calls them, have names that lead elsewhere or are no text."""
    name = stream.choice([text for text in TEXTS if len(text) < 500] + ["a/b", "../x", "x" * 300])
    table = pq.read_table(campaign / TABLE)
    old = stream.choice(["explored", "collisions", "robots", "half"])
    _put(campaign, table.rename_columns([name if own == old else own
                                         for own in table.column_names]))
    text = (campaign / DESIGN).read_text()
    if stream.random() < 0.8:
        data = yaml.safe_load(text)
        data["report"] = {**data.get("report", {}), "metrics": [name]}
        if old in data["parameters"]:
            data["parameters"][name] = data["parameters"].pop(old)
            data["report"]["against"] = stream.choice([name, None])
        (campaign / DESIGN).write_text(yaml.safe_dump(data))


def other_rows(campaign: Path, stream: random.Random) -> None:
    """Rows of the table are twice there, gone, or many; so are columns."""
    table = pq.read_table(campaign / TABLE)
    _put(campaign, stream.choice([
        lambda: pa.concat_tables([table, table]), lambda: table.slice(0, 0),
        lambda: table.slice(0, 1), lambda: table.select([]), lambda: pa.table({"x": [1]}),
        lambda: pa.concat_tables([table] * 20_000),
        lambda: pa.Table.from_arrays([*table.columns, table["explored"]],
                                     names=[*table.column_names, "explored"]),
        lambda: pa.table({**{name: table[name] for name in table.column_names},
                          **{f"metric_{n}": [1.5] * len(table) for n in range(3000)}})])())


def other_metadata(campaign: Path, stream: random.Random) -> None:
    """The table's metadata say other things."""
    table = pq.read_table(campaign / TABLE)
    good = {"name": "d", "version": 1, "parameters": {"robots": ["robots"], "network": ["rate"]},
            "fixed": {"terrain": MARKUP, "strategy": "x -->"}}
    said = stream.choice([*VALUES, {"explored": 1}, {"explored": [1, MARKUP]},
                          {MARKUP: ["x", None]}, {"explored": [1, "x" * 3_000_000]},
                          good, good, {**good, "name": MARKUP}, {"__class__": 1}, {**good, "x": 1},
                          {**good, "parameters": {"robots": "rate"}}, {**good, "fixed": []}])
    raw = stream.choice([json.dumps(said), "[" * 1_000_000, "\xff", "{", "1" * 5000])
    key = stream.choice([RAISED, REFERENCE, "ARROW:schema", "pandas"])
    _put(campaign, table.replace_schema_metadata({key: raw}))
    if stream.random() < 0.5:
        data = yaml.safe_load((campaign / DESIGN).read_text())
        data["question"] = f"<!-- end of leaderboard -->{MARKUP}"
        data["reference"] = {"version": 1}
        (campaign / DESIGN).write_text(yaml.safe_dump(data))


def bombs(campaign: Path, stream: random.Random) -> None:
    """A small file would take gigabytes, or hours."""
    stream.choice([_rows_bomb, _text_bomb, _design_bomb, _index_bomb, _sparse])(campaign, stream)


def _rows_bomb(campaign: Path, stream: random.Random) -> None:
    """10^9 rows, all equal, of each column or of one."""
    table = pq.read_table(campaign / TABLE).slice(0, 1)
    names = table.column_names if stream.random() < 0.2 else ["run_id", "status", "explored"]
    part = pa.table({name: pa.DictionaryArray.from_arrays(
        pa.array([0] * 10**6, pa.int32()), table[name].combine_chunks()) for name in names})
    with pq.ParquetWriter(campaign / TABLE, part.schema, compression="zstd") as writer:
        for _ in range(stream.choice([40, 1000 if len(names) == 3 else 40])):
            writer.write_table(part)


def _text_bomb(campaign: Path, stream: random.Random) -> None:
    """A text of many MB, which packs well, in each row."""
    table = pq.read_table(campaign / TABLE)
    text = "x" * stream.choice([10**7, 10**8])
    table = table.drop_columns(["error"]).append_column("error", pa.array([text] * len(table)))
    pq.write_table(table, campaign / TABLE, compression="zstd",
                   use_dictionary=stream.random() < 0.5)


def _design_bomb(campaign: Path, stream: random.Random) -> None:
    from hostile_files import BOMBS

    text = (campaign / DESIGN).read_text()
    data = yaml.safe_load(text)
    many = [*range(2000)]
    data.update(stream.choice([
        {"parameters": {f"p{n}": {"key": f"a.b{n}", "values": many} for n in range(9)}},
        {"parameters": {"p": {"key": "fleet.size", "from": 1, "to": 1e9, "count": 10**9}}},
        {"metrics": {"half": "**".join(["9"] * 50)}}, {"metrics": {"half": "(" * 5000}},
        {"metrics": {"half": "+".join(["explored"] * 9000)}}, {"iterations": 10**12},
        {"metrics": {f"m{n}": "explored" for n in range(5000)}}]))
    (campaign / DESIGN).write_text(stream.choice([
        yaml.safe_dump(data), stream.choice(["", text]) + stream.choice(BOMBS)()]))


def _index_bomb(campaign: Path, stream: random.Random) -> None:
    lines = (campaign / INDEX).read_bytes()
    (campaign / INDEX).write_bytes(stream.choice([
        b"x" * 50_000_000, b"\n" * 20_000_000, lines * 5000, lines + b"[" * 9_000_000,
        _line({"run_id": "0" * 12, "status": "failed", "error": "x" * 9_000_000}) * 9]))


def _sparse(campaign: Path, stream: random.Random) -> None:
    with open(campaign / stream.choice([DESIGN, TABLE, INDEX]), "r+b") as file:
        file.truncate(10**10)


def other_design(campaign: Path, stream: random.Random) -> None:
    """A value of the design is something else, or names code or files."""
    data = yaml.safe_load((campaign / DESIGN).read_text())
    key = stream.choice([*data, "question", "metrics", "report", "base", "reference", "stop"])
    value: Any = stream.choice([*VALUES, *TEXTS])
    named = {"metrics": {stream.choice(["half", MARKUP, "a/b"]): stream.choice(
                 ["evil:evil", f"{campaign}/evil:evil", "__import__('os')", value])},
             "report": {"metrics": [value], "against": value, "by": "rate"},
             "parameters": {"robots": {"key": "fleet.size", "values": [1, value]},
                            "rate": {"key": value, "values": [1, 2]}}}
    data[key] = stream.choice([value, named.get(key, value)])
    (campaign / DESIGN).write_text(yaml.safe_dump(data))


def other_index(campaign: Path, stream: random.Random) -> None:
    """A line of the index, with a right checksum, says something else; or lines are cut."""
    lines = (campaign / INDEX).read_bytes().splitlines(keepends=True)
    at = stream.randrange(len(lines))
    row = json.loads(lines[at])
    row.pop("check")
    how = stream.randrange(5)
    if how == 0:
        lines[at] = lines[at][:stream.randrange(len(lines[at]))]
    elif how == 1:
        row["run_id"] = stream.choice(["../../victim.txt", "/etc/passwd", "", "a\0b", MARKUP])
    elif how == 2:
        row["metrics"][stream.choice([*row["metrics"], MARKUP])] = stream.choice(VALUES)
    elif how == 3:
        row[stream.choice([*row, "raised"])] = stream.choice([*VALUES, {"evil:evil": MARKUP}])
    else:
        row = {"run_id": row["run_id"], "status": "failed", "folder": row["folder"],
               "error": stream.choice([*VALUES, *TEXTS])}
    if how:
        lines[at] = _line(row)
    (campaign / INDEX).write_bytes(b"".join(lines))


def links(campaign: Path, stream: random.Random) -> None:
    """A file or folder is a link, a pipe, or something else; there are devices' names."""
    run = _run(campaign, stream)
    path = stream.choice([
        campaign / stream.choice([DESIGN, TABLE, INDEX, ".lock", RUNS, f"{RUNS}/small", "report",
                                  "report/figures", "report/report.html", "output", ".index.new"]),
        run, run / stream.choice(["manifest.json", SUMMARY, "ledger_topics.json", "map"])])
    if path.is_dir() and not path.is_symlink():
        path.rename(campaign / "elsewhere")
    elif os.path.lexists(path):
        path.unlink()
    path.parent.mkdir(parents=True, exist_ok=True)
    target = stream.choice(["/dev/zero", "../victim.txt", "..", "pipe", "folder", path.name,
                            "/proc/self/mem", "/nowhere", str(campaign.parent / "victim")])
    if target == "pipe":
        os.mkfifo(path)
    elif target == "folder":
        path.mkdir()
    else:
        path.symlink_to(target)


def evil_runs(campaign: Path, stream: random.Random) -> None:
    """The folder of a run is hostile, or twice there, or there are many of odd names."""
    run = _run(campaign, stream)
    how = stream.randrange(6)
    if how < 3:
        hostile_folders.hostile(run, stream.randrange(10**6))
    elif how == 3:
        shutil.copytree(run, campaign / RUNS / stream.choice(["other", "a\nb", "\x1b[31m"])
                        / run.name)
    elif how == 4:
        for name in ("\x1b[31m", os.fsdecode(b"\xff\xfe"), "a\nb", "0" * 12, "x" * 255):
            (run.parent / name).mkdir()
        for number in range(3000):
            (run.parent / f"{number:012x}").mkdir(exist_ok=True)
    else:
        place = campaign / RUNS / "small"
        for _ in range(300):
            place /= "deep"
        place.mkdir(parents=True)


def evil_texts(campaign: Path, stream: random.Random) -> None:
    """Texts that a report prints have markup, or what a terminal obeys: with right seals."""
    text = stream.choice(TEXTS)
    run = _run(campaign, stream)
    for name in (SUMMARY, "ledger_topics.json"):
        (run / name).write_text(_replaced_keys((run / name).read_text(), text, stream))
    hostile_folders.resealed(run, lambda manifest: manifest.update(
        status="failed", error=text) if stream.random() < 0.5 else None)
    table = pq.read_table(campaign / TABLE)
    for name in ("error", "stop_reason", "rate", "digest"):
        table = table.drop_columns([name]).append_column(name, pa.array([text] * len(table)))
    if stream.random() < 0.5:
        table = table.drop_columns(["status"]).append_column(
            "status", pa.array(["failed", "finished"] * (len(table) // 2)))
    _put(campaign, table)
    data = yaml.safe_load((campaign / DESIGN).read_text())
    data["question"] = text
    (campaign / DESIGN).write_text(yaml.safe_dump(data))


def _replaced_keys(text: str, word: str, stream: random.Random) -> str:
    """The JSON with another key or value somewhere."""
    data = json.loads(text)
    at = data
    while at and isinstance(at, dict | list):
        keys = list(at) if isinstance(at, dict) else [*range(len(at))]
        key = stream.choice(keys)
        if stream.random() < 0.4:
            if isinstance(at, dict) and stream.random() < 0.5:
                at[word[:200]] = at.pop(key)
            else:
                at[key] = stream.choice([word, *VALUES])
            break
        at = at[key]
    return json.dumps(data)


def evil_module(campaign: Path, stream: random.Random) -> None:
    """Modules, settings of libraries and of Python lie in the folder; the design names them."""
    for place in (campaign, campaign.parent, _run(campaign, stream)):
        for name in ("evil", "sitecustomize", "usercustomize", "numpy", "desim", "small"):
            (place / f"{name}.py").write_text(_MODULE)
        (place / "matplotlibrc").write_text("backend: module://evil\ntext.usetex: True\n")
        (place / ".numba_config.yaml").write_text("disable_jit: 1\ndump_ir: 1\n")
        (place / "pyproject.toml").write_text("[")
    data = yaml.safe_load((campaign / DESIGN).read_text())
    name = stream.choice(["evil:evil", f"{campaign}/evil:evil", "./evil:evil"])
    data["metrics"] = {"half": name}
    data["report"] = {"metrics": [stream.choice(["half", name])]}
    (campaign / DESIGN).write_text(yaml.safe_dump(data))
    hostile_folders.set_code(_run(campaign, stream), stream.choice(hostile_folders.CODE))


def _run(campaign: Path, stream: random.Random) -> Path:
    return stream.choice(sorted(path for path in (campaign / RUNS / "small").iterdir()
                                if path.is_dir()))


def _line(row: dict[str, Any]) -> bytes:
    """A line of the index, with its right checksum; NaN and all."""
    return index.line_of(row)


def _put(campaign: Path, table: pa.Table) -> None:
    pq.write_table(table, campaign / TABLE, compression="zstd")


ATTACKS: list[Callable[[Path, random.Random], None]] = [
    other_columns, other_names, other_rows, other_metadata, bombs, other_design, other_index,
    links, evil_runs, evil_texts, evil_module]
