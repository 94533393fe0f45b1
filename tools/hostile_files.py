"""Single files as an attacker would make them: recordings, logs, traces, maps, images and YAML.

``hostile`` makes one of them by its number, in the same way each time, in an empty folder, and
returns the commands that read it. Some are folders of runs
(``hostile_folders.py``) and campaigns (``hostile_campaigns.py``): copies of good ones, which are
made once, beside the folder.
"""

from __future__ import annotations

import bz2
import gzip
import random
import shutil
import sqlite3
import struct
import zlib
from collections.abc import Callable
from pathlib import Path

from guarded import MINE

Commands = list[list[str]]
SCENARIO = "name: x\nfleet: {size: 1}\nstop: {elapsed: 20 ms}\n"
SMALL = """\
name: small
environment: {terrain: {size: [12 m, 12 m]}}
fleet: {size: 2, start: {from: [-4 m, 4 m], step: [2 m, 0 m]}}
robot: {laser: {beams: 20}}
network: {media: {lan: {model: switch, rate: 10 Mb/s, rules: [{rule: loss, probability: 1 %}]}}}
stop: {elapsed: 50 ms}
trace: {keep: all, ledger: true}
"""
DESIGN = """\
name: d
base: small.yaml
question: Why?
parameters:
  robots: {key: fleet.size, values: [1, 2]}
  rate: {key: network.media.lan.rate, from: 1 Mb/s, to: 2 Mb/s, count: 2}
vectors: all
iterations: 2
metrics: {half: explored / 2}
report: {metrics: [explored], against: robots}
"""
IMPORT = ["import", "--out", "out"]
RUN = ["run", "--quiet", "--out", "out", "s.yaml"]
MAP = {"image": "map.pgm", "resolution": "0.1", "origin": "[0, 0, 0]", "negate": "0",
       "occupied_thresh": "0.65", "free_thresh": "0.196"}
VALUES = ["nan", ".nan", ".inf", "-1", "0", "1e400", "1e308", "9" * 5000, "1" + ":59" * 5000,
          "null", "[]", "{}", "&a [*a]", "../../etc/passwd", "/dev/zero", "/proc/self/mem",
          '"\\e[31m"', '"a\\0b"', "x" * 20_000, "!!python/object:os.system x", "2026-01-01"]
BOMBS = [lambda: "[" * 300_000, lambda: "[\n" * 200_000, lambda: "{a: " * 100_000,
         lambda: "- " * 50_000, lambda: "? " * 50_000,
         lambda: "".join(f"k{n}: 0\n" for n in range(900_000)),
         lambda: "a0: &a0 [x]\n" + "".join(
             f"a{n}: &a{n} [{', '.join([f'*a{n - 1}'] * 9)}]\n" for n in range(1, 12)),
         lambda: "a: &a {<<: [" + "{b: 1}, " * 30_000 + "]}\n",
         lambda: "name: '" + "x" * 9_000_000 + "'\n", lambda: "&a " * 100_000,
         lambda: "# " + "x" * 9_900_000, lambda: "\n" * 9_900_000, lambda: "x" * 11_000_000]


def hostile(folder: Path, kind: str, number: int) -> Commands:
    """Make the file of this kind and number in ``folder``."""
    return KINDS[kind](folder, random.Random(f"hostile {kind} {number}"))


def scenario(folder: Path, stream: random.Random) -> Commands:
    (folder / "s.yaml").write_text(stream.choice(["", SCENARIO]) + stream.choice(BOMBS)())
    return [RUN]


def design(folder: Path, stream: random.Random) -> Commands:
    (folder / "s.yaml").write_text(SCENARIO)
    (folder / "d.yaml").write_text(stream.choice(["", "name: d\nbase: s.yaml\n"])
                                   + stream.choice(BOMBS)())
    return [["sweep", "d.yaml", "--dry-run", "--out", "out"]]


def map_yaml(folder: Path, stream: random.Random) -> Commands:
    keys = dict(MAP)
    if stream.random() < 0.7:
        keys[stream.choice(sorted(MAP))] = stream.choice(VALUES)
        text = "".join(f"{key}: {value}\n" for key, value in keys.items())
    else:
        text = stream.choice(BOMBS)()
    _image(folder, b"P5\n4 4\n255\n" + b"\xfe" * 16)
    (folder / "map.yaml").write_text(text)
    return [RUN]


def image(folder: Path, stream: random.Random) -> Commands:
    wide, high = (stream.choice(["4", "0", "-1", "60000", "8000", "9" * 20, "nan"]) for _ in "ab")
    _image(folder, stream.choice([
        f"P{stream.choice('1256f')}\n{wide} {high}\n255\n".encode() + b"\xfe" * 16,
        b"P5\n" + b"#" * 3_000_000, b"P5\n7900 7900\n255\n" + bytes(7900 * 7900),
        b"%!PS-Adobe-3.0 EPSF-3.0\n%%BoundingBox: 0 0 9 9\n{} loop\n", b"GIF89a" + bytes(99),
        png(stream.choice([60_000, 7900]), 7900), png(2**31 - 1, 1), b"", b"BM" + bytes(99),
        stream.randbytes(2000), b"II*\0\xff\xff\xff\xff", b"\xff\xd8\xff\xe0" + bytes(500)]))
    return [RUN]


def _image(folder: Path, data: bytes) -> None:
    (folder / "map.pgm").write_bytes(data)
    (folder / "map.yaml").write_text("".join(f"{key}: {value}\n" for key, value in MAP.items()))
    (folder / "s.yaml").write_text(SCENARIO + "environment: {terrain: {map: map.yaml}}\n")


def png(width: int, height: int) -> bytes:
    """A PNG, all zeros: far smaller than what it unpacks to."""
    def part(kind: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + kind + data + struct.pack(
            ">I", zlib.crc32(kind + data))
    pixels = bytes((width + 1) * height) if width * height < 10**8 else b""
    return (b"\x89PNG\r\n\x1a\n"
            + part(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 0, 0, 0, 0))
            + part(b"IDAT", zlib.compress(pixels, 1)) + part(b"IEND", b""))


def carmen(folder: Path, stream: random.Random) -> Commands:
    line = stream.choice([
        "FLASER 180 " + "0 " * 180 + "0 0 0 0 0 0 {n} h {n}\n", "ODOM 0 0 0 0 0 0 {n} h {n}\n",
        "RAWLASER1\n", "FLASER 0 0 0 0 0 0 0 {n} h {n}\n", "FLASER -1 0\n", "x" * 50_000_000,
        "FLASER 100001 " + "0 " * 200_000 + "\n", "FLASER 2 nan inf 0 0 0 0 0 0 {n} h {n}\n",
        "ROBOTLASER1 0 0 0 1e-320 1 0 0 99999 " + "0 " * 300_000 + "\n", "\x1b[31m\0\n"])
    count = max(1, stream.choice([3, 100_000_000]) // len(line))
    text = line.replace("{n}", "1" if count > 1e5 else "7").encode() * count
    packed = stream.choice([gzip.compress(text, 1), text[:3_000_000],
                            gzip.compress(text, 1)[:-stream.randrange(1, 20)]])
    (folder / "log").write_bytes(packed)
    return [["slam", "log", "--to", "out/log.png"]]


def trace(folder: Path, stream: random.Random) -> Commands:
    rows = stream.choice(["1,a,b,0.5\n", "nan,a,b,0.5\n", "1,a,b,1e400\n",
                          "1," + "a" * 200_000 + "\n",
                          "1,\"a", "-1,a,b,0.5\n", "1,../x,\x1b[31m,0.5\n", "9" * 50_000_000])
    head = stream.choice(["time_s,source,destination,delivery_ratio\n", "{" + "[" * 100_000 + "\n",
                          "x_m,y_m,node,rssi_dbm\n"])
    text = (head + rows * max(1, stream.choice([1, 100_000_000]) // len(rows))).encode()
    (folder / "t.csv").write_bytes(stream.choice([text[:2_000_000], gzip.compress(text, 1)]))
    (folder / "s.yaml").write_text(SCENARIO.replace("1}", "2}") + "network: {media: {lan: {model: "
                                   "replay, file: t.csv}}}\n")
    return [RUN]


def mcap(folder: Path, stream: random.Random) -> Commands:
    from mcap.writer import CompressionType, Writer

    kind, text = stream.choice([
        ("nav_msgs/msg/OccupancyGrid", "uint8[0] a"), ("std_msgs/msg/Float64", "float64 data"),
        ("nav_msgs/msg/Path", "std_msgs/Empty[] poses\n" + "=" * 80 + "\nMSG: std_msgs/Empty\n"),
        ("geometry_msgs/msg/PoseStamped", "[" * 50_000), ("x/msg/Y", "")])
    with (folder / "a.mcap").open("wb") as file:
        writer = Writer(file, chunk_size=1 << 30, compression=stream.choice(
            [CompressionType.LZ4, CompressionType.ZSTD, CompressionType.NONE]))
        writer.start()
        encoding = stream.choice(["cdr", "ros1"])
        channel = writer.register_channel(stream.choice(["/a", "\x1b[31m", "../x", ""]), encoding,
                                          writer.register_schema(
            kind, "ros1msg" if encoding == "ros1" else "ros2msg", text.encode()))
        size, count = stream.choice([(300_000_000, 1), (8, 1_000_000), (40_000_000, 9),
                                     (4, 3)])
        for number in range(count):
            writer.add_message(channel, number, b"\xff" * 4 + bytes(size - 4) if size < 99 else
                               bytes(size), number)
        writer.finish()
    return [[*IMPORT, _damaged(folder / "a.mcap", stream)]]


def bag(folder: Path, stream: random.Random) -> Commands:
    from rosbags.rosbag1 import Writer as BagWriter
    from rosbags.typesys import Stores, get_typestore

    writer = BagWriter(folder / "a.bag")
    how = stream.choice(["BZ2", "LZ4", "none"])
    if how != "none":
        writer.set_compression(BagWriter.CompressionFormat[how])
    with writer:
        connection = writer.add_connection("/a", "std_msgs/msg/Float64",
                                           typestore=get_typestore(Stores.ROS1_NOETIC))
        size, count = stream.choice([(100_000_000, 2), (8, 100_000), (30_000_000, 9), (8, 3)])
        for number in range(count):
            writer.write(connection, number, bytes(size))
    return [[*IMPORT, _damaged(folder / "a.bag", stream)]]


def bag_folder(folder: Path, stream: random.Random) -> Commands:
    import lz4.frame
    from rosbags.rosbag2.reader import zstd

    (folder / "b").mkdir()
    name = stream.choice(["a.db3", "a.mcap", "a.db3.zstd", "..", "../../victim", "\\e[31m"])
    mode = stream.choice(["", "file", "message"])
    (folder / "b" / "metadata.yaml").write_text(stream.choice([
        *(bomb() for bomb in stream.sample(BOMBS, 2)), *[
            "rosbag2_bagfile_information: {version: 5, storage_identifier: sqlite3, "
            f"relative_file_paths: [\"{name}\"], compression_format: zstd, compression_mode: "
            f"\"{mode}\", topics_with_message_count: [], duration: {{nanoseconds: 1}}, "
            "starting_time: {nanoseconds_since_epoch: 0}, message_count: 1}\n"] * 4]))
    (folder / "b" / "a.db3.zstd").write_bytes(zstd.compress(bytes(300_000_000)))
    made = stream.choice(["", "CREATE VIEW v AS SELECT 1;",
                          "CREATE TABLE m (a, b AS (zeroblob(9)))"])
    database = sqlite3.connect(folder / "b" / "a.db3")
    database.executescript("CREATE TABLE messages (id, topic_id, timestamp, data); CREATE TABLE "
                           f"topics (id, name, type, serialization_format);{made}")
    database.close()
    (folder / "b" / "a.mcap").write_bytes(stream.choice(
        [lz4.frame.compress(bytes(10**6)), bz2.compress(b"x"), b""]))
    return [[*IMPORT, "b"]]


def run_folder(folder: Path, stream: random.Random) -> Commands:
    from hostile_folders import hostile as harm

    shutil.copytree(good(folder) / "results", folder / "results")
    run, = (folder / "results" / "small").iterdir()
    (run / MINE).write_text("precious")
    harm(run, stream.randrange(10**6))
    name = str(run.relative_to(folder))
    return stream.sample([
        ["why", name], ["why", name, "--dropped", "--json"], ["trace", name],
        ["trace", name, "--message", "1"], ["diff", name, name], ["compare", name, name],
        ["ls", "results"], ["check", name], ["figure", name], ["view", name, "--no-open"],
        ["view", name, name, "--no-open", "--to", "out/v.html"],
        ["figure", name, "--to", "out/figure.pdf"],
        ["export", name, "--csv", "out/csv"], ["export", name, "--mcap", "out/m.mcap"],
        ["export", name, "--bag", "out/b.bag"], ["export", name, "--graphml", "out/g.graphml"],
        ["export", name, "--pcap", "out/p.pcap"], ["graph", name, "--json"],
        ["graph", name, "--to", "out/g.png"]], 2)


def campaign_folder(folder: Path, stream: random.Random) -> Commands:
    from hostile_campaigns import hostile as harm

    for name in ("campaign", "small.yaml", "design.yaml"):
        source = good(folder) / name
        (shutil.copytree if source.is_dir() else shutil.copy)(source, folder / name)
    for place in (folder, folder / "campaign", next((folder / "campaign/runs/small").iterdir())):
        (place / MINE).write_text("precious")
    harm(folder / "campaign", stream.randrange(10**6))
    return stream.sample([
        ["check", "campaign"], ["ls", "campaign"], ["ls", ".", "--json"],
        ["compare", "campaign", "campaign"], ["compare", "campaign", "campaign", "--json"],
        ["report", "campaign"], ["report", "campaign", "--quiet", "--out", "out/report"],
        ["report", "campaign", "--design", "design.yaml", "--out", "out/report"],
        ["report", "campaign", "--leaderboard", "out/board.md"],
        ["sweep", "design.yaml", "--dry-run", "--out", "campaign"],
        ["sweep", "design.yaml", "--quiet", "--jobs", "1", "--out", "campaign"]], 3)


def good(folder: Path) -> Path:
    """A folder with a run and a campaign, made once, beside ``folder``."""
    import desim
    from desim.cli import app

    place = folder.parent / "good"
    if not place.exists():
        place.mkdir()
        (place / "small.yaml").write_text(SMALL)
        (place / "design.yaml").write_text(DESIGN)
        desim.run(place / "small.yaml", out=place / "results")
        app(["sweep", str(place / "design.yaml"), "--quiet", "--jobs", "1", "--out",
             str(place / "campaign")], standalone_mode=False)
    return place


def _damaged(path: Path, stream: random.Random) -> str:
    """Perhaps cut the file, or turn some bytes, or make a length huge."""
    data = bytearray(path.read_bytes())
    how = stream.randrange(4)
    if how == 1:
        del data[stream.randrange(len(data)):]
    elif how == 2:
        for _ in range(9):
            data[stream.randrange(len(data))] = stream.randrange(256)
    elif how == 3:
        at = stream.randrange(min(len(data) - 8, 200))
        data[at:at + 8] = b"\xff" * stream.choice([4, 7, 8])
    path.write_bytes(data)
    return path.name


KINDS: dict[str, Callable[[Path, random.Random], Commands]] = {kind.__name__: kind for kind in (
    scenario, design, map_yaml, image, carmen, trace, mcap, bag, bag_folder, run_folder,
    campaign_folder)}
