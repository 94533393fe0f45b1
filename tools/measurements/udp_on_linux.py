"""How old is data that comes over a saturated link by UDP? Linux's answer, with real sockets.

    sudo python tools/measurements/udp_on_linux.py all > desim/validation/udp_on_linux.csv
    sudo python tools/measurements/udp_on_linux.py camera 4    # rows, and how many at a time

Each row joins two network namespaces by a veth pair whose sender shapes what it sends (``tc``, a
token bucket of 1 ms, 4 kB at least) and whose receiver loses IP packets by chance (``nft``).
Programs in one namespace publish messages in datagrams of up to 62 500 B from timers that skip the
ticks that they have missed; one program in the other reads them. A message's age counts from the
call that publishes it to the read of its last datagram. Rows are played three times. What is
committed was measured on Linux 6.18.44 (HZ 250, two busy cores) with net.core.wmem_default and
rmem_default 212 992, net.ipv4.ipfrag_high_thresh 4 194 304 and ipfrag_time 30, seven rows at a
time; those named ``fragments`` twice, nine at a time beside other work.
"""

from __future__ import annotations

import csv
import socket
import struct
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import NamedTuple

DATAGRAM_BYTES = 62_500
HEADER = struct.Struct("!HIBBd")  # stream, number, part, parts, born
REPETITIONS = 3
COLUMNS = ("row", "rate_mbps", "queue_bytes", "send_buffer_bytes", "receive_buffer_bytes",
           "reader_sleeps_ms", "loss", "seconds", "repetition", "stream", "size_bytes", "rate_hz",
           "socket", "published", "arrived", "p50_ms", "p95_ms", "max_ms")


class Stream(NamedTuple):
    """Messages of one kind. Streams of one ``socket`` are timers of one process, in one thread or,
    where the name ends in +, in a thread each."""

    name: str
    size_bytes: int
    rate_hz: float
    socket: str = "own"


class Row(NamedTuple):
    """One path, and what is published over it. Buffers are what setsockopt is asked for, which
    Linux doubles; 0: the default, 212 992 B."""

    name: str
    streams: tuple[Stream, ...]
    rate_mbps: float = 25
    queue_bytes: int = 30_000_000
    send_buffer_bytes: int = 0
    receive_buffer_bytes: int = 0
    reader_sleeps_ms: float = 0
    loss: float = 0
    seconds: int = 20


def camera(size_bytes: int = 187_500, rate_hz: float = 30, socket: str = "camera") -> Stream:
    return Stream("camera", size_bytes, rate_hz, socket)


def pose(socket: str, size_bytes: int = 100) -> Stream:
    return Stream("pose", size_bytes, 5, socket)


ROWS = (
    Row("camera", (camera(),)),
    # Below, at and above what the link carries: 60 kB at 30 Hz are 14.9 Mb/s with headers.
    Row("60k_25", (camera(60_000),)),
    Row("100k_25", (camera(100_000),)),
    Row("105k_25", (camera(105_000),)),
    Row("110k_25", (camera(110_000),)),
    Row("20k_5", (camera(20_000),), 5),
    Row("20k_5_slow", (camera(20_000, 20),), 5),
    Row("60k_5", (camera(60_000),), 5),
    Row("187k_5", (camera(),), 5),
    Row("20k_25_fast", (camera(20_000, 200),)),
    Row("187k_100", (camera(),), 100),
    Row("187k_100_fast", (camera(rate_hz=70),), 100),
    Row("two", (camera(socket="one"), Stream("second", 187_500, 30, "two"))),
    Row("two_60k", (camera(60_000, socket="one"), Stream("second", 60_000, 30, "two"))),
    Row("beside", (camera(), pose("pose"))),
    Row("one_thread", (camera(socket="same"), pose("same"))),
    Row("two_threads", (camera(socket="same+"), pose("same+"))),
    Row("beside_5", (camera(20_000), pose("pose")), 5),
    Row("half_buffer", (camera(),), send_buffer_bytes=53_248),
    Row("half_buffer_20k", (camera(20_000, 200),), send_buffer_bytes=53_248),
    Row("double_buffer", (camera(),), send_buffer_bytes=212_992),
    Row("four_buffers_20k", (camera(20_000, 200),), send_buffer_bytes=425_984),
    Row("short_queue", (camera(60_000, 60),), queue_bytes=100_000),
    Row("short_queue_beside", (camera(), pose("pose")), queue_bytes=100_000),
    *(Row(f"reader_{ms}_{kb}k", (camera(kb * 1000),), 100, reader_sleeps_ms=ms)
      for ms in (5, 20, 50) for kb in (1, 20, 60)),
    Row("reader_5_187k", (camera(),), 100, reader_sleeps_ms=5),
    Row("reader_20_187k", (camera(),), 100, reader_sleeps_ms=20),
    Row("reader_50_20k_half", (camera(20_000),), 100, reader_sleeps_ms=50,
        receive_buffer_bytes=53_248),
    # Fragments of what is incomplete wait for 30 s, in 4 MiB at most.
    Row("lossy_1", (camera(62_000, 10), pose("pose", 2000)), 100, loss=0.01, seconds=60),
    Row("lossy_1_slow", (camera(62_000, 2), pose("pose", 2000)), 100, loss=0.01, seconds=60),
    Row("lossy_3", (camera(62_000, 10), pose("pose", 2000)), 100, loss=0.03, seconds=60),
    *(Row(f"fragments_{hz}_{100 * loss:.0f}", (camera(62_000, hz),), 100, loss=loss, seconds=240)
      for hz, loss in ((6, 0.02), (3, 0.03), (2, 0.05))),
    Row("lossy_20", (camera(62_000, 10), pose("pose", 2000), Stream("small", 100, 5, "small")),
        100, loss=0.2, seconds=60),
    Row("lossy_20_quick", (camera(20_000), pose("pose", 2000)), 100, loss=0.2, seconds=60),
)


def publish(streams: Sequence[Stream], numbers: Sequence[int], path: Row) -> None:
    """The program of one socket: print how many messages of each stream it published."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as link:
        if path.send_buffer_bytes:
            link.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, path.send_buffer_bytes)
        link.connect(("10.79.0.2", 7000))
        begin = time.time()
        end = begin + path.seconds
        if streams[0].socket.endswith("+"):
            counts = [0] * len(streams)

            def own(k: int) -> None:
                counts[k], = _timers(link, streams[k:k + 1], numbers[k:k + 1], begin, end)
            threads = [threading.Thread(target=own, args=(k,)) for k in range(len(streams))]
            for thread in threads:
                thread.start()
            for thread in threads:
                thread.join()
        else:
            counts = _timers(link, streams, numbers, begin, end)
    print(*counts)


def _timers(link: socket.socket, streams: Sequence[Stream], numbers: Sequence[int],
            begin: float, end: float) -> list[int]:
    counts, ticks = [0] * len(streams), [0] * len(streams)
    while True:
        k = min(range(len(streams)), key=lambda k: ticks[k] / streams[k].rate_hz)
        due = begin + ticks[k] / streams[k].rate_hz
        if due >= end or time.time() >= end:
            return counts
        if (wait := due - time.time()) > 0:
            time.sleep(wait)
        now, rate_hz = time.time(), streams[k].rate_hz
        parts = _parts(streams[k].size_bytes)
        for part, size_bytes in enumerate(parts):
            header = HEADER.pack(numbers[k], counts[k], part, len(parts), now)
            link.send(header + bytes(max(0, size_bytes - HEADER.size)))
        counts[k] += 1
        ticks[k] = max(ticks[k] + 1, int((time.time() - begin) * rate_hz))


def _parts(size_bytes: int) -> list[int]:
    whole, rest = divmod(size_bytes, DATAGRAM_BYTES)
    return [DATAGRAM_BYTES] * whole + [rest] * bool(rest)


def read(path: Row) -> None:
    """The reading program: print the age of each whole message."""
    there: dict[tuple[int, int], int] = {}
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as link:
        if path.receive_buffer_bytes:
            link.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, path.receive_buffer_bytes)
        link.bind(("10.79.0.2", 7000))
        end = time.time() + path.seconds + 3
        print("ready", flush=True)
        try:
            while True:
                link.settimeout(max(end - time.time(), 3))
                data = link.recv(70_000)
                stream, number, _, parts, born = HEADER.unpack(data[:HEADER.size])
                there[stream, number] = there.get((stream, number), 0) + 1
                if there[stream, number] == parts:
                    print(stream, time.time() - born)
                if path.reader_sleeps_ms:
                    time.sleep(path.reader_sleeps_ms / 1000)
        except TimeoutError:
            pass


def play(name: str, repetition: int) -> Iterator[tuple[object, ...]]:
    """The lines of one run, one a stream."""
    path = _row(name)
    spaces = [f"udp_{name}_{repetition}_{end}" for end in "ab"]
    with _Path(path, spaces):
        reader = _start(spaces[1], "read", name)
        assert reader.stdout is not None and reader.stdout.readline() == "ready\n"
        sockets = list(dict.fromkeys(stream.socket for stream in path.streams))
        writers = [_start(spaces[0], "publish", name, each) for each in sockets]
        published = {}
        for each, writer in zip(sockets, writers, strict=True):
            counts = map(int, writer.communicate()[0].split())
            published |= dict(zip(_of(path, each), counts, strict=True))
        ages: dict[int, list[float]] = {k: [] for k in range(len(path.streams))}
        for line in reader.communicate()[0].splitlines():
            stream, age_s = line.split()
            ages[int(stream)].append(1000 * float(age_s))
    for k, stream in enumerate(path.streams):
        late = sorted(ages[k])
        figures = [round(late[min(len(late) - 1, int(share * len(late)))], 2)
                   for share in (0.5, 0.95, 1)] if late else ["", "", ""]
        yield (name, *path[2:], repetition, *stream, published[k], len(late), *figures)


class _Path:
    """Two namespaces, and what joins them."""

    def __init__(self, path: Row, spaces: Sequence[str]) -> None:
        self._path, self._spaces = path, spaces

    def __enter__(self) -> None:
        sender, receiver = self._spaces
        for space in self._spaces:
            _do(f"ip netns add {space}")
        _do(f"ip -n {sender} link add wire type veth peer name wire netns {receiver}")
        for k, space in enumerate(self._spaces):
            _do(f"ip -n {space} link set lo up")
            _do(f"ip -n {space} addr add 10.79.0.{k + 1}/24 dev wire")
            _do(f"ip -n {space} link set wire up address 02:00:00:00:00:0{k}")
            _do(f"ip -n {space} neigh add 10.79.0.{2 - k} lladdr 02:00:00:00:00:0{1 - k} dev wire")
        _do(f"tc -n {sender} qdisc add dev wire root tbf rate {self._path.rate_mbps}mbit "
            f"burst {max(4000, round(125 * self._path.rate_mbps))} "
            f"limit {self._path.queue_bytes}")
        if self._path.loss:
            for words in ("add table netdev air", "add chain netdev air in { type filter hook "
                          "ingress device wire priority 0 ; }", "add rule netdev air in numgen "
                          f"random mod 10000 < {round(10_000 * self._path.loss)} drop"):
                _do(f"ip netns exec {receiver} nft", words)

    def __exit__(self, *_: object) -> None:
        for space in self._spaces:
            _do(f"ip netns del {space}")


def _do(command: str, *words: str) -> None:
    subprocess.run([*command.split(), *words], check=True, stdout=subprocess.DEVNULL)


def _start(space: str, *words: str) -> subprocess.Popen[str]:
    return subprocess.Popen(["nice", "-n", "-10", "ip", "netns", "exec", space, sys.executable,
                             __file__, *words], stdout=subprocess.PIPE, text=True)


def _row(name: str) -> Row:
    return next(row for row in ROWS if row.name == name)


def _of(path: Row, socket_name: str) -> list[int]:
    return [k for k, stream in enumerate(path.streams) if stream.socket == socket_name]


def table(names: Iterable[str], at_a_time: int) -> None:
    runs = [(name, repetition) for repetition in range(REPETITIONS) for name in names]
    lines = csv.writer(sys.stdout, lineterminator="\n")
    lines.writerow(COLUMNS)
    with ThreadPoolExecutor(at_a_time) as pool:
        for rows in pool.map(lambda run: list(play(*run)), runs):
            lines.writerows([row[0], *row[1:]] for row in rows)
            sys.stdout.flush()


def main(words: Sequence[str]) -> None:
    programs: dict[str, Callable[[], None]] = {
        "read": lambda: read(_row(words[1])),
        "publish": lambda: publish(
            [_row(words[1]).streams[k] for k in _of(_row(words[1]), words[2])],
            _of(_row(words[1]), words[2]), _row(words[1]))}
    if words and words[0] in programs:
        programs[words[0]]()
        return
    at_a_time = int(words[-1]) if words[-1].isdigit() else 1
    names = [word for word in words if not word.isdigit()]
    table([row.name for row in ROWS] if names == ["all"] else names, at_a_time)


if __name__ == "__main__":
    main(sys.argv[1:])
