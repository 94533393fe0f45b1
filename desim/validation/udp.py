"""UDP over a saturated link: how old data gets, and what full buffers lose.

``udp_on_linux.csv`` was measured with real sockets (tools/measurements/udp_on_linux.py).
"""

from __future__ import annotations

import csv
from collections.abc import Iterable, Iterator
from fractions import Fraction
from functools import partial
from importlib.resources import files
from statistics import median
from typing import NamedTuple

from desim import plugins
from desim.engine.kernel import Kernel, Phase
from desim.engine.streams import Streams
from desim.engine.trace import Names, Trace
from desim.middleware.dds.wire import CYCLONEDDS
from desim.middleware.direct import Direct
from desim.middleware.graph import Graph
from desim.middleware.graph_options import GraphOptions
from desim.middleware.host import Host
from desim.middleware.node import Node
from desim.network.carrier import Carrier
from desim.network.medium import Medium
from desim.network.surroundings import Nowhere
from desim.ports.cases import Check
from desim.scenario.schema.sockets import Sockets
from desim.units import NS_PER_S
from desim.validation.laboratory import CHECK_SEQUENCE_BYTES

TOKEN_BUCKET_BYTES = 1514  # of a full packet; the medium's have the check sequence, too
DATAGRAM_BYTES = 62_500
PROGRAMS_MS = 0.5  # what the programs and the machine take themselves
# Where two share a socket, one in two small messages waits for two thirds of a large one, the other
# for all of it: the median is either.
EITHER = "one_thread", "two_threads"
SHARES = "fragments_"  # where only these are compared: the machine was too busy for ages

Ages = dict[str, tuple[int, int, float, float]]  # published, arrived; 50 and 95 % in ms


class Path(NamedTuple):
    """A row of the table: what is published over a link, and what came of it in several runs."""

    name: str
    streams: dict[str, dict[str, str]]  # by name: one of its lines
    measured: dict[str, list[dict[str, str]]]

    def of(self, column: str) -> float:
        return float(next(iter(self.streams.values()))[column])

    @property
    def bucket_ms(self) -> float:
        """The time of what a full token bucket of 1 ms, 4 kB at least, lets through at once."""
        return max(4000 * 8 / (1000 * self.of("rate_mbps")), 1.0)

    def repeats(self, stream: str, column: str) -> bool:
        """Whether what was measured repeats within 20 %: where it is left to chance which program
        starts first, it does not."""
        values = [float(line[column] or "nan") for line in self.measured[stream]]
        return max(values) - min(values) <= max(0.2 * median(values), PROGRAMS_MS)

    def medians(self, stream: str) -> tuple[float, float, float]:
        """The share that arrived, and the ages that 50 and 95 % are below (NaN: none came)."""
        lines = self.measured[stream]
        share = median(int(line["arrived"]) / int(line["published"]) for line in lines)
        p50_ms, p95_ms = (median(float(line[column] or "nan") for line in lines)
                          for column in ("p50_ms", "p95_ms"))
        return share, p50_ms, p95_ms


def paths() -> list[Path]:
    """The rows of the table."""
    out: dict[str, Path] = {}
    with (files("desim.validation") / "udp_on_linux.csv").open(encoding="utf-8") as table:
        for line in csv.DictReader(table):
            path = out.setdefault(line["row"], Path(line["row"], {}, {}))
            path.streams.setdefault(line["stream"], line)
            path.measured.setdefault(line["stream"], []).append(line)
    return list(out.values())


def checks() -> Iterator[Check]:
    yield from ages(paths())


def ages(rows: Iterable[Path], seeds: int = 3) -> Iterator[Check]:
    for path in rows:
        runs = [UdpPath(path, seed).ages() for seed in range(seeds if path.of("loss") else 1)]
        for stream in path.streams:
            share, *measured_ms = path.medians(stream)
            what = f"UDP {path.name}, {stream}"
            yield Check(f"{what}: share that arrives",
                        median(run[stream][1] / run[stream][0] for run in runs), share,
                        max(0.2 * share, 0.02))
            if path.name.startswith(SHARES) or share < 0.02:
                continue
            if path.of("reader_sleeps_ms") and share > 0.98:
                continue  # a program sleeps behind a datagram, the model's reader before it
            for place, column, measured in zip((2, 3), ("p50_ms", "p95_ms"), measured_ms,
                                               strict=True):
                either = path.name in EITHER and (stream, column) == ("pose", "p50_ms")
                if either or not path.repeats(stream, column):
                    continue
                simulated = median(run[stream][place] for run in runs)
                yield Check(f"{what}: age, {column[1:3]} %", simulated, measured,
                            max(0.2 * measured, path.bucket_ms + PROGRAMS_MS), "ms")


class Talker(Node):
    """A node of one program: timers that publish messages in datagrams through one socket."""

    def __init__(self, host: Host, name: str, bench: UdpPath, streams: tuple[str, ...]) -> None:
        super().__init__(host, name)
        self._bench, self._streams = bench, streams

    def start(self) -> None:
        for stream in self._streams:
            rate_hz = Fraction(self._bench.path.streams[stream]["rate_hz"])
            self.timer(rate_hz, partial(self._publish, stream), start="zero")

    def _publish(self, stream: str, _: int) -> None:
        bench, line = self._bench, self._bench.path.streams[stream]
        if self.now_ns >= bench.end_ns:
            return
        left_bytes, number = int(line["size_bytes"]), bench.published[stream]
        bench.published[stream] += 1
        parts = -(-left_bytes // DATAGRAM_BYTES)
        for _ in range(parts):
            size_bytes, packets = CYCLONEDDS.udp(min(left_bytes, DATAGRAM_BYTES))
            left_bytes -= DATAGRAM_BYTES
            self.host.sockets.named(line["socket"]).send(
                bench.medium, (1,), size_bytes, packets, False, bench.log,
                (stream, number, parts, self.now_ns), packets, self.name)


class Log(Carrier[tuple[str, int, int, int]]):
    """The ages of whole messages, by stream."""

    def __init__(self, kernel: Kernel) -> None:
        self._kernel = kernel
        self._there: dict[tuple[str, int], int] = {}
        self.late_ms: dict[str, list[float]] = {}

    def arrived(self, token: tuple[str, int, int, int], receiver: int) -> None:
        stream, number, parts, born_ns = token
        there = self._there[stream, number] = self._there.get((stream, number), 0) + 1
        if there == parts:
            self.late_ms.setdefault(stream, []).append((self._kernel.now_ns - born_ns) / 1e6)


class UdpPath:
    """Two hosts, the link between them, and the programs of a path."""

    def __init__(self, path: Path, seed: int = 0) -> None:
        self.path = path
        self.kernel, names, streams = Kernel(), Names(), Streams(seed)
        self.log = Log(self.kernel)
        self.published = dict.fromkeys(path.streams, 0)
        self.end_ns = round(path.of("seconds") * NS_PER_S)
        buffers = {name: f"{2 * path.of(f'{name}_bytes'):.0f} B"
                   for name in ("send_buffer", "receive_buffer") if path.of(f"{name}_bytes")}
        graph = Graph(self.kernel, names, Trace(names), streams, Direct(Direct.Params()),
                      ("a", "b"), GraphOptions(sockets=Sockets(
                          read=f"{path.of('reader_sleeps_ms')} ms", **buffers)))
        link, chance = plugins.load("network", "link"), plugins.load("rule", "loss")
        rate_mbps = path.of("rate_mbps") * (1 + CHECK_SEQUENCE_BYTES / TOKEN_BUCKET_BYTES)
        self.medium = Medium(
            "wire", link(link.Params(rate=f"{rate_mbps} Mb/s",
                                     queue=f"{path.of('queue_bytes'):.0f} B")),
            [chance(chance.Params(probability=path.of("loss")))] if path.of("loss") else [],
            kernel=self.kernel, names=names, streams=streams, hosts=["a", "b"], place=Nowhere(2))
        graph.attach(self.medium)
        graph.host("a").software = self._software
        for host in graph.hosts:
            self.kernel.at(0, Phase.WORLD, host.id, Host.start, host)

    def _software(self, host: Host) -> list[Node]:
        """A node for each socket, or for each of its threads where its name ends in +."""
        programs: dict[str, tuple[str, ...]] = {}
        for stream, line in self.path.streams.items():
            name = stream if line["socket"].endswith("+") else line["socket"]
            programs[name] = (*programs.get(name, ()), stream)
        return [Talker(host, name, self, own) for name, own in programs.items()]

    def ages(self) -> Ages:
        self.kernel.run(self.end_ns + 20 * NS_PER_S)
        out: Ages = {}
        for stream, published in self.published.items():
            late_ms = sorted(self.log.late_ms.get(stream, []))
            quantiles = [late_ms[min(len(late_ms) - 1, int(share * len(late_ms)))]
                         if late_ms else float("nan") for share in (0.5, 0.95)]
            out[stream] = published, len(late_ms), quantiles[0], quantiles[1]
        return out
