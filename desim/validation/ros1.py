"""ROS 1: from a call to the first message.

Measured with rosmaster, roscpp and rospy 1.15.15 (Debian), each host's programs started some
seconds apart; the later of two calls is the one that counts.
"""

from __future__ import annotations

from collections.abc import Iterator
from statistics import mean

from desim.middleware.contents import Filler
from desim.middleware.ros1.ros1 import Ros1
from desim.ports.cases import Check
from desim.validation.laboratory import KNOWN_ADDRESSES, LabNode, Laboratory, within

# Who comes last, one-way delay: ms from its call to the first message.
FIRST_MESSAGE_MS = {("subscriber", "50 us"): 210, ("publisher", "50 us"): 210,
                    ("subscriber", "20 ms"): 603, ("publisher", "20 ms"): 515}


def checks() -> Iterator[Check]:
    yield from first_messages()


def first_messages() -> Iterator[Check]:
    """A latched message; the mean of eight starts."""
    for (last, delay), measured_ms in FIRST_MESSAGE_MS.items():
        simulated_ms = mean(_first_ms(last, delay, seed) for seed in range(8))
        yield within(0.2, f"ROS 1, {delay} one way: first message after the {last}'s call",
                     simulated_ms, measured_ms, "ms")


def _first_ms(last: str, delay: str, seed: int) -> float:
    def publish(node: LabNode) -> None:
        node.advertise("/map", latch=True)
        node.publish("/map", Filler(200))

    starts_s = {"master": 0, "publisher": 1, "subscriber": 1} | {last: 5}
    lives = {"master": lambda node: None, "publisher": publish,
             "subscriber": lambda node: node.listens("/map")}
    params = Ros1.Params(master="master", tcp=KNOWN_ADDRESSES)
    bench = Laboratory(lives, Ros1(params), delay=delay, seed=seed,
                  starts_s=[starts_s[host] for host in lives]).run(10)
    return 1000 * bench.received_after("subscriber", starts_s[last])
