"""Zenoh: what it costs to find each other and to be there, and links near the end of their lease.

Measured with zenoh 1.10.2 (PyPI eclipse-zenoh). "zenoh" is its default timing, "rmw_zenoh" that of
rmw_zenoh (a lease of 60 s, two keep-alives).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import Any

from desim.middleware.zenoh.zenoh import Zenoh
from desim.ports.cases import Check
from desim.validation.bench import Bench, Speaker, alike, within

# Preset, seconds of the cut, queue (0: put blocks; else it drops): seconds from the first start to
# the cut beyond BEFORE_S, and from its end to the first message.
HEARD_AGAIN = {
    ("zenoh", 8, 0): ((0, 0.97, 1.94, 2.91, 3.88, 4.85, 5.82, 6.79),
                      (10.42, 2.65, 8.49, 7.52, 6.54, 5.57, 4.52, 4.84)),
    ("zenoh", 15, 0): ((0, 0.97, 1.94, 2.91, 3.88, 4.85, 5.82, 6.79),
                       (3.41, 2.46, 1.49, 0.50, 0.85, 6.57, 5.68, 4.64)),
    ("zenoh", 15, 10): ((0, 0.97, 1.94, 2.91, 3.88, 4.85, 5.82, 6.79),
                        (7.33, 2.45, 1.49, 0.52, 0.84, 7.37, 5.64, 4.64)),
    ("rmw_zenoh", 60, 10): ((0, 1.97, 3.94, 5.91), (30.84, 29.75, 34.48, 32.52)),
    ("rmw_zenoh", 100, 10): ((0, 1.97, 3.94, 5.91), (6.80, 4.49, 2.57, 1.82)),
}
BEFORE_S = 12.71  # the second host starts 1.3 s after the first one; then 9.4 s and tcpdump


def checks() -> Iterator[Check]:
    yield from discovery()
    yield from at_rest()
    yield from heard_again()


def discovery() -> Iterator[Check]:
    """The first 15 s of hosts that start some 10 ms apart."""
    for what, bytes_ in (("4 hosts, 9 publishers and 8 subscribers each", 100_001),):
        bench = Bench(dict(_fleet(4)), Zenoh(Zenoh.Params(preset="zenoh")),
                      starts_s=[0.02 * k for k in range(4)]).run(15)
        yield within(0.15, f"Zenoh: first 15 s of {what}", bench.tap.bytes, bytes_, "B")


def _fleet(hosts: int) -> Iterator[tuple[str, Callable[[Speaker], Any]]]:
    for me in range(hosts):
        def life(node: Speaker, me: int = me) -> None:
            for j in range(9):
                node.says(f"/robot_{me}/topic{j}", 100, 0)
            for j in range(8):
                node.listens(f"/robot_{(me + 1 + j) % hosts}/topic{j}")
        yield f"robot_{me}", life


def at_rest() -> Iterator[Check]:
    """Keep-alives, scouts and hellos, from 15 to 45 s after the start."""
    bench = Bench({f"robot_{k}": lambda node: None for k in range(8)},
                  Zenoh(Zenoh.Params(preset="zenoh")),
                  starts_s=[0.035 * k for k in range(8)]).run(15)
    before = bench.tap.bytes
    yield within(0.15, "Zenoh: 8 routers at rest", (bench.run(45).tap.bytes - before) / 30, 3426,
                 "B/s")


def heard_again(cells: Sequence[tuple[str, int, int]] = tuple(HEARD_AGAIN)) -> Iterator[Check]:
    """1 kB at 10 Hz one way and at 1 Hz the other way, over one cut."""
    for preset, cut_s, queue in cells:
        phases, measured = HEARD_AGAIN[preset, cut_s, queue]
        simulated = [_again(preset, cut_s, queue, BEFORE_S + phase) for phase in phases]
        yield from alike(f"{preset}, {'drop' if queue else 'block'}: heard again after {cut_s} s",
                         simulated, measured, "s")


def _again(preset: str, cut_s: float, queue: int, from_s: float) -> float:
    def speak(node: Speaker) -> None:
        node.says("/k0", 1000, 10, queue=queue)
        node.listens("/k1")

    def listen(node: Speaker) -> None:
        node.says("/k1", 1000, 1, queue=queue)
        node.listens("/k0")

    until_s = from_s + cut_s
    bench = Bench({"robot_0": speak, "robot_1": listen}, Zenoh(Zenoh.Params(preset=preset)),
                  cuts=[(from_s, until_s)], starts_s=[0, 1.3]).run(until_s + 50)
    return bench.heard_after("robot_1", until_s)
