"""Zenoh: what it costs to find each other and to be there, and links near the end of their lease.

Measured with zenoh 1.10.2 (PyPI eclipse-zenoh). "zenoh" is its default timing, "rmw_zenoh" that of
rmw_zenoh (a lease of 60 s, two keep-alives).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence

from desim.middleware.zenoh.zenoh import Zenoh
from desim.ports.cases import Check
from desim.validation.laboratory import KNOWN_ADDRESSES, LabNode, Laboratory, alike, within

# Preset, seconds of the cut: of each run how much later the second host started, how long after the
# start of the first one the cut began, and from its end to the first message.
RUNS = {
    ("zenoh", 5): ((1.30, 12.68, 1.81), (1.31, 13.66, 1.61), (1.29, 14.61, 1.66),
                   (1.29, 15.58, 1.54), (1.28, 16.56, 1.66), (1.23, 17.43, 1.63),
                   (1.30, 18.49, 1.44), (1.36, 19.46, 1.56)),
    ("zenoh", 8): ((1.29, 12.66, 10.44), (1.24, 12.87, 10.24), (1.36, 13.09, 10.02),
                   (1.31, 13.25, 9.87), (0.96, 13.10, 9.93), (1.29, 13.64, 2.77),
                   (1.17, 13.68, 9.43), (1.24, 13.90, 9.21), (1.32, 14.63, 8.48),
                   (1.31, 15.59, 7.51), (1.29, 16.56, 6.45), (1.34, 17.53, 5.58),
                   (1.30, 18.50, 4.60), (1.29, 19.45, 5.15)),
    ("zenoh", 15): ((1.31, 12.69, 3.41), (1.31, 12.68, 7.33), (1.30, 13.64, 2.46),
                    (1.31, 13.66, 2.45), (1.29, 14.61, 1.49), (1.30, 14.62, 1.49),
                    (1.33, 15.60, 0.50), (1.29, 15.58, 0.52), (1.32, 16.56, 0.85),
                    (1.34, 16.57, 0.84), (1.31, 17.54, 6.57), (1.31, 17.54, 7.37),
                    (1.25, 18.44, 5.68), (1.27, 18.47, 5.64), (1.29, 19.46, 4.64),
                    (1.30, 19.46, 4.64)),
    ("rmw_zenoh", 15): ((1.30, 12.63, 11.72), (1.30, 13.97, 11.48), (1.32, 15.29, 11.58),
                        (1.31, 16.62, 12.14), (1.29, 17.91, 11.53), (1.30, 19.16, 11.53),
                        (1.06, 12.27, 11.70), (1.31, 14.65, 12.22), (1.31, 16.62, 12.14),
                        (1.31, 18.59, 12.16)),
    ("rmw_zenoh", 60): ((0.99, 12.28, 30.84), (1.23, 14.57, 29.75), (1.32, 16.62, 34.48),
                        (1.30, 18.58, 32.52)),
    ("rmw_zenoh", 100): ((1.16, 12.34, 6.80), (1.35, 14.61, 4.49), (1.30, 16.54, 2.57),
                         (1.33, 18.59, 1.82)),
}
# The same of publishers that block (CongestionControl BLOCK), of a cut of 60 s.
BLOCKED = ((1.30, 12.63, 14.42), (1.30, 13.97, 14.48), (1.32, 15.29, 19.81), (1.31, 16.62, 18.49),
           (1.29, 17.91, 17.16), (1.30, 19.16, 15.85))
KEPT = 143  # of 150 messages that are sent in a cut of 15 s: as many as socket and two batches hold

Lives = dict[str, Callable[[LabNode], object]]


def checks() -> Iterator[Check]:
    yield from discovery()
    yield from floods()
    yield from at_rest()
    yield from received_again()
    yield from blocked()
    yield from kept()


def _zenoh(preset: str) -> Zenoh:
    return Zenoh(Zenoh.Params(preset=preset, tcp=KNOWN_ADDRESSES))


def discovery() -> Iterator[Check]:
    """The traffic of the first 15 s of routers that start some 10 ms apart (8 without nodes: the
    median of five runs, 243 to 259 kB)."""
    rows: tuple[tuple[str, Lives, int], ...] = (
        ("4 hosts, 9 publishers and 8 subscribers each", _fleet(4), 102_160),
        ("8 hosts, the same", _fleet(8), 566_814), ("8 routers alone", _quiet(8), 252_981))
    for what, lives, bytes_ in rows:
        bench = Laboratory(lives, _zenoh("zenoh"), starts_s=[0.05 * k for k in range(len(lives))])
        yield within(0.15, f"Zenoh: first 15 s of {what}", bench.run(15).tap.bytes, bytes_, "B")


def floods(only: slice = slice(None)) -> Iterator[Check]:
    """Routers that start in one instant, medians of three (16 alone: one run). Bytes alone where
    the machine could not keep up: its routers put several messages into one frame."""
    fleets: tuple[tuple[str, Lives, int, int], ...] = (
        ("12 hosts", _fleet(12), 1_870_562, 12_435), ("16 hosts", _fleet(16), 4_804_174, 0),
        ("16 routers alone", _quiet(16), 3_581_760, 33_449),
        ("24 hosts", _fleet(24), 18_795_758, 0))
    for what, lives, bytes_, frames in fleets[only]:
        tap = Laboratory(lives, _zenoh("zenoh")).run(15).tap
        what = f"Zenoh: {what} that start at once, first 15 s"
        yield within(0.15, what, tap.bytes, bytes_, "B")
        if frames:
            yield within(0.15, f"{what}, frames", tap.packets, frames)


def _quiet(hosts: int) -> Lives:
    return {f"robot_{k}": lambda node: None for k in range(hosts)}


def _fleet(hosts: int) -> Lives:
    def life(me: int) -> Callable[[LabNode], object]:
        def begin(node: LabNode) -> None:
            for j in range(9):
                node.publishes(f"/robot_{me}/topic{j}", 100, 0)
            for j in range(8):
                node.listens(f"/robot_{(me + 1 + j) % hosts}/topic{j}")
        return begin
    return {f"robot_{me}": life(me) for me in range(hosts)}


def at_rest() -> Iterator[Check]:
    """Keep-alives, scouts and hellos, from 15 to 45 s after the start."""
    bench = Laboratory(_quiet(8), _zenoh("zenoh"),
                       starts_s=[0.035 * k for k in range(8)]).run(15)
    before = bench.tap.bytes
    yield within(0.15, "Zenoh: 8 routers at rest", (bench.run(45).tap.bytes - before) / 30, 3426,
                 "B/s")


def received_again(cells: Sequence[tuple[str, int]] = tuple(RUNS)) -> Iterator[Check]:
    """1 kB at 10 Hz one way and at 1 Hz the other way, over one cut; messages without room are
    dropped."""
    for preset, cut_s in cells:
        runs = RUNS[preset, cut_s]
        simulated = [_again(preset, cut_s, *run[:2]) for run in runs]
        yield from alike(f"{preset}: heard again after {cut_s} s", simulated,
                         [run[2] for run in runs], "s")


def blocked() -> Iterator[Check]:
    """A blocked publisher closes the link after a minute without progress (wait_before_close),
    which is after the end of the lease, the later the more the socket takes."""
    yield from alike("rmw_zenoh, publishers that block: heard again after 60 s",
                     [_again("rmw_zenoh", 60, *run[:2], queue=0) for run in BLOCKED],
                     [run[2] for run in BLOCKED], "s")


def kept() -> Iterator[Check]:
    """Messages without room are dropped, or block."""
    bench = _cut("rmw_zenoh", 15, 1.3, 13, 10)
    received = sum(13 <= born < 28 for *_, born in bench.node("robot_1").received)
    yield within(0.15, "rmw_zenoh: of 150 messages in a cut of 15 s there is room for", received,
                 KEPT)


def _again(preset: str, cut_s: float, start_s: float, from_s: float, queue: int = 10) -> float:
    return _cut(preset, cut_s, start_s, from_s, queue).received_after("robot_1", from_s + cut_s)


def _cut(preset: str, cut_s: float, start_s: float, from_s: float, queue: int) -> Laboratory:
    def speak(node: LabNode) -> None:
        node.publishes("/k0", 1000, 10, queue=queue)
        node.listens("/k1")

    def listen(node: LabNode) -> None:
        node.publishes("/k1", 1000, 1, queue=queue)
        node.listens("/k0")

    until_s = from_s + cut_s
    return Laboratory({"robot_0": speak, "robot_1": listen}, _zenoh(preset),
                      cuts=[(from_s, until_s)], starts_s=[0, start_s]).run(until_s + 50)
