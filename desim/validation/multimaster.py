"""multimaster: what masters that find and copy each other cost.

Measured with multimaster_fkie 1.3.2 at the heartbeats of the paper's time (heartbeat_hz 2,
timeout_factor 1.4): each host publishes one topic that all others subscribe to, by nodes of their
own, and nobody publishes.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from statistics import mean

from desim.middleware.multimaster.multimaster import Multimaster
from desim.ports.cases import Check
from desim.validation.laboratory import KNOWN_ADDRESSES, LabNode, Laboratory, within

HEARD_AGAIN_S = 1.40  # the mean of several cuts, both ways
FIRST_40_S = {2: 38_000, 4: 242_000}  # hosts: bytes


def checks() -> Iterator[Check]:
    yield from discovery()
    yield from received_again()


def discovery() -> Iterator[Check]:
    """The bytes of heartbeats, calls between masters, and links."""
    for hosts, measured in FIRST_40_S.items():
        params = Multimaster.Params(preset="fkie_1_3_groovy", tcp=KNOWN_ADDRESSES)
        bench = Laboratory({f"h{me}": _life(me, hosts) for me in range(hosts)}, Multimaster(params))
        yield within(0.15, f"multimaster: first 40 s of {hosts} quiet hosts",
                     bench.run(40).tap.bytes, measured, "B")


def received_again(runs: int = 20, **constants: object) -> Iterator[Check]:
    """The delay after a cut of 20 s, of two hosts with ten messages of 1 kB a second. It takes a
    heartbeat, a time that sync draws, and a link; cuts end at any time between two heartbeats."""
    late_s = [late for seed in range(runs) for late in _again(seed, constants)]
    yield within(0.15, "multimaster: heard again after 20 s: mean", mean(late_s), HEARD_AGAIN_S,
                 "s")


def _again(seed: int, constants: dict[str, object]) -> list[float]:
    def talk(me: int) -> Callable[[LabNode], object]:
        def begin(node: LabNode) -> None:
            node.publishes(f"/talk{me}", 1000, 10, queue=10)
            node.listens(f"/talk{1 - me}", 2000)
        return begin

    from_s = 40 + 0.37 * seed  # at any time between two heartbeats and looks
    bench = Laboratory({f"h{me}": talk(me) for me in range(2)}, Multimaster(Multimaster.Params(
        preset="fkie_1_3_groovy", tcp=KNOWN_ADDRESSES, constants=constants)), seed=seed,
        cuts=[(from_s, from_s + 20)]).run(from_s + 35)
    return [bench.received_after(f"h{me}", from_s + 20) for me in range(2)]


def _life(me: int, hosts: int) -> Callable[[LabNode], object]:
    def begin(node: LabNode) -> None:
        node.publishes(f"/talk{me}", 100, 0)
        for other in range(hosts):
            if other != me:
                node.listens(f"/talk{other}")
    return begin
