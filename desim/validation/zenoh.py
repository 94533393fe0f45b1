"""Zenoh: what it costs to be there."""

from __future__ import annotations

from collections.abc import Iterator

from desim.middleware.zenoh.zenoh import Zenoh
from desim.ports.cases import Check
from desim.validation.bench import Bench, within


def checks() -> Iterator[Check]:
    yield from at_rest()


def at_rest() -> Iterator[Check]:
    """Keep-alives, scouts and hellos, from 15 to 45 s after the start."""
    bench = Bench({f"robot_{k}": lambda node: None for k in range(8)},
                  Zenoh(Zenoh.Params(preset="zenoh"))).run(15)
    before = bench.tap.bytes
    yield within(0.1, "Zenoh: 8 routers at rest", (bench.run(45).tap.bytes - before) / 30, 3426,
                 "B/s")
