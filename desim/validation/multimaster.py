"""multimaster: what masters that find and copy each other cost.

Measured with multimaster_fkie 1.3.2 at the heartbeats of the paper's time (heartbeat_hz 2,
timeout_factor 1.4): each host publishes one topic that all others subscribe to, by nodes of their
own, and nobody says anything.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

from desim.middleware.multimaster.multimaster import Multimaster
from desim.ports.cases import Check
from desim.validation.bench import KNOWN_ADDRESSES, Bench, Speaker, within

FIRST_40_S = {2: 38_000, 4: 242_000}  # hosts: bytes


def checks() -> Iterator[Check]:
    yield from discovery()


def discovery() -> Iterator[Check]:
    """Heartbeats, calls between masters, links."""
    for hosts, measured in FIRST_40_S.items():
        params = Multimaster.Params(preset="fkie_1_3_groovy", tcp=KNOWN_ADDRESSES)
        bench = Bench({f"h{me}": _life(me, hosts) for me in range(hosts)}, Multimaster(params))
        yield within(0.15, f"multimaster: first 40 s of {hosts} quiet hosts",
                     bench.run(40).tap.bytes, measured, "B")


def _life(me: int, hosts: int) -> Callable[[Speaker], Any]:
    def begin(node: Speaker) -> None:
        node.says(f"/talk{me}", 100, 0)
        for other in range(hosts):
            if other != me:
                node.listens(f"/talk{other}")
    return begin
