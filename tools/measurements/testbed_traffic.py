"""What loads the paper's network? The tables of docs/testbed-traffic.md.

    python tools/measurements/testbed_traffic.py [account|fleets|terrains] [--seconds N] [--seed N]

It runs scenarios/paper/published.yaml with the keys that add the testbed's real traffic, and
prints Markdown. ``account``: 8 robots in the maze, item by item, with all headers: as desim
measures it, and by hand from message definitions and rates. ``fleets``: the rates of 8 and of 30
robots with maps of the terrain's size and of the published one. ``terrains``: 8 robots in each of
the four.
"""

from __future__ import annotations

import argparse
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np

from desim.engine.trace import Names
from desim.middleware.contents import (
    FLOAT64_BYTES,
    ODOMETRY_BYTES,
    POSE_STAMPED_BYTES,
    TWIST_BYTES,
    laser_scan_bytes,
    occupancy_grid_bytes,
)
from desim.middleware.headers import on_wire, stream_frame
from desim.middleware.ros1.sizes import CALLS
from desim.monitor.traffic import family
from desim.robot.transform_broadcaster import ODOMETRY_BYTES as TF_BYTES
from desim.scenario.load import load
from desim.scenario.names import WORKSTATION
from desim.simulation.simulation import Simulation
from desim.units import NS_PER_S

PUBLISHED = Path(__file__).resolve().parents[2] / "scenarios" / "paper" / "published.yaml"
LARGE_MAPS = "robot.mapping.published_size=[160 m, 160 m]"
REAL = ("testbed.processes={scan: 3, tf: 4}", "robot.tf=own", "robot.laser.beams=191",
        "robot.laser.rate=30 Hz", "middleware.polling=100 ms", "middleware.polled_topics=20",
        "middleware.tcp.acks=sent")
MEGABIT = 1e6 / 8
PAPER = 85.0  # Mb/s, 8 robots


class Item(NamedTuple):
    """One item of the account. ``names``: families of topics, or kinds of the middleware's frames.
    ``by_hand``: bytes a second of so many robots, at most."""

    text: str
    names: tuple[str, ...]
    by_hand: Callable[[int], float]
    basis: str


def frame(size_bytes: int) -> int:
    """The bytes of a message over TCP, with all headers."""
    return stream_frame(size_bytes)[0]


def poll(robots: int) -> int:
    """The bytes of a call of getPublishedTopics and its answer."""
    sizes = CALLS["getPublishedTopics"]
    return on_wire(sizes.call)[0] + on_wire(sizes.answer + sizes.answer_each * 20 * robots)[0]


GRID = frame(occupancy_grid_bytes(800 * 800))
ITEMS = (
    Item("laser scans, three processes a robot", ("/*/scan", "/*/scan/copy_2", "/*/scan/copy_3"),
         lambda n: 3 * 30 * n * frame(laser_scan_bytes(191)),
         "size: definition; rate: MORSE's real one; 3: launch file"),
    Item("odometry", ("/*/odom",), lambda n: 10 * n * frame(ODOMETRY_BYTES),
         "size: definition; rate: the paper"),
    Item("tf of the odometry, four processes a robot",
         ("/*/tf", "/*/tf/copy_2", "/*/tf/copy_3", "/*/tf/copy_4"),
         lambda n: 4 * 10 * n * frame(TF_BYTES), "size: definition; 4: launch file"),
    Item("commands", ("/*/cmd_vel",), lambda n: 10 * n * frame(TWIST_BYTES),
         "size: definition; at most 10 Hz: launch file"),
    Item("explored maps to the monitor", ("/*/explored_map",), lambda n: n * GRID,
         "size: launch file (800 x 800); rate: the paper, 1 Hz"),
    Item("distances to the monitor", ("/*/distance",), lambda n: n * frame(FLOAT64_BYTES),
         "size: definition; rate: the paper"),
    Item("map_merging asks the master", ("getPublishedTopics",), lambda n: 10 * n * poll(n),
         "rate: map_merging.cpp; sizes: counted, 20 topics a robot"),
    Item("maps between robots", ("/map_exchange/*",), lambda n: n * (n - 1) / 5 * GRID,
         "size: launch file; at most every 5 s: gmapping; rate: what the robots do"),
    Item("poses between robots", ("/map_exchange/*/pose",),
         lambda n: 10 * n * (n - 1) * frame(POSE_STAMPED_BYTES),
         "size: definition; rate: robot_pose_publisher"),
)


class Wire:
    """Bytes with all headers by sender, receiver and item, as a run's trace has them. Give ``sink``
    to the simulation."""

    def __init__(self) -> None:
        self.bytes: Counter[tuple[int, int, int]] = Counter()  # ids; of a topic or kind the last
        self._kinds: tuple[int, int, int] | None = None
        self._topics: dict[tuple[int, int], int] = {}  # by sender and number

    def name(self, names: Names) -> None:
        self._kinds = names.id("sent"), names.id("frame"), names.id("control")

    def sink(self, rows: np.ndarray) -> None:
        assert self._kinds is not None
        sent, framed, control = self._kinds
        for _, kind, entity, a, b, c in rows[np.isin(rows["kind"], self._kinds)].tolist():
            if kind == sent:
                self._topics[entity, b] = a
            elif kind == framed:
                self.bytes[entity, a, self._topics[entity, b]] += c
            elif kind == control:
                self.bytes[entity, a, b] += c


class Measured(NamedTuple):
    """A run, and its bytes by sender, receiver and family of topics or kind of frames."""

    simulation: Simulation
    seconds: float
    bytes: Counter[tuple[str, str, str]]

    def rate(self, of: Callable[[str, str, str], bool]) -> float:
        """Mb/s of what ``of(sender, receiver, item)`` selects."""
        return sum(size_bytes for key, size_bytes in self.bytes.items() if of(*key)
                   ) / self.seconds / MEGABIT


def measured(seconds: float, seed: int, *overrides: str) -> Measured:
    """A run of so many seconds, or until the terrain is explored."""
    wire = Wire()
    loaded = load(PUBLISHED, [*REAL, *overrides, f"stop.elapsed={seconds} s"], seed)
    simulation = Simulation(loaded.scenario, trace_sink=wire.sink)
    wire.name(simulation.names)
    outcome = simulation.run()
    simulation.trace.flush()
    names, hosts = simulation.names, frozenset(host.name for host in simulation.graph.hosts)
    totals: Counter[tuple[str, str, str]] = Counter()
    for (sender, receiver, what), size_bytes in wire.bytes.items():
        totals[names[sender], names[receiver], family(names[what], hosts)] += size_bytes
    return Measured(simulation, outcome.simulated_ns / NS_PER_S, totals)


def account(seconds: float, seed: int) -> None:
    """Print the account of 8 robots in the maze."""
    robots = 8
    run = measured(seconds, seed, f"fleet.size={robots}", LARGE_MAPS)
    print(f"8 robots, maze, {run.seconds:.0f} s, seed {seed}, Mb/s with all headers:\n")
    print("| item | workstation | between robots | by hand | what is assumed |\n"
          "|---|---|---|---|---|")
    covered = {name for item in ITEMS for name in item.names}

    def row(text: str, names: Callable[[str], bool], by_hand: str, basis: str) -> None:
        at = [run.rate(lambda sender, receiver, what, inside=inside: names(what) and (
            WORKSTATION in (sender, receiver)) is inside) for inside in (True, False)]
        print(f"| {text} | {' | '.join(map(cell, at))} | {by_hand} | {basis} |")

    for item in ITEMS:
        row(item.text, item.names.__contains__, f"{item.by_hand(robots) / MEGABIT:.2f}", item.basis)
    row("registrations, ARP and the rest", lambda what: what not in covered, "",
        "docs/middleware/ros1.md")
    graph, out, in_ = run.simulation.graph, *(run.rate(
        lambda *ends, side=side: ends[side] == WORKSTATION) for side in (0, 1))
    host = graph.host(WORKSTATION)
    interface = (host.tx_bytes + host.rx_bytes) / run.seconds / MEGABIT
    acks = graph.context.discovery_bytes["ack"] / run.seconds / MEGABIT
    own_acks = interface - out - in_  # they leave no rows
    everything = run.rate(lambda *_: True) + acks
    print(f"| acknowledgements of TCP | {cell(own_acks)} | {cell(acks - own_acks)} | | Linux, as "
          "desim models it |")
    print(f"| all | {interface:.2f} | {everything - interface:.2f} | | |\n")
    sent, received = (getattr(host, key) / run.seconds / MEGABIT for key in (
        "tx_bytes", "rx_bytes"))
    print(f"The workstation sends {sent:.1f} Mb/s and receives {received:.1f} Mb/s, together "
          f"{interface:.1f} Mb/s = {interface / 8:.1f} MB/s: {interface / PAPER:.0%} of "
          f"{PAPER:g} Mb/s. The whole network carries {everything:.1f} Mb/s.")


def cell(rate: float) -> str:
    """Mb/s in the account."""
    return f"{rate:.2f}" if rate >= 0.005 else ""


def fleets(seconds: float, seed: int) -> None:
    """Print the rates of robots and workstation for fleets and sizes of maps."""
    print("| robots | maps | a robot receives | and sends | workstation, both ways |\n"
          "|---|---|---|---|---|")
    for robots in (8, 30):
        for text, case in (("160 kB, the terrain", ()), ("640 kB, published", (LARGE_MAPS,))):
            run = measured(seconds, seed, f"fleet.size={robots}", *case)
            hosts = run.simulation.graph.hosts
            own = [host for host in hosts if host.name != WORKSTATION]
            received, sent = (sum(getattr(host, key) for host in own) / len(own) / run.seconds
                              for key in ("rx_bytes", "tx_bytes"))
            among = run.rate(lambda sender, receiver, _: WORKSTATION not in (sender, receiver))
            station = run.rate(lambda sender, receiver, _: WORKSTATION in (sender, receiver))
            print(f"| {robots} | {text} | {rates(received)}; of robots "
                  f"{rates(among * MEGABIT / robots)} | {rates(sent)} | "
                  f"{rates(station * MEGABIT)} |")


def rates(bytes_per_s: float) -> str:
    """A rate in both readings."""
    return f"{bytes_per_s / MEGABIT:.1f} Mb/s = {bytes_per_s / 1e6:.2f} MB/s"


def terrains(seconds: float, seed: int) -> None:
    """Print the traffic of 8 robots in each of the paper's terrains."""
    print("| terrain | run | a robot receives, mean | and sends | all that was sent |\n"
          "|---|---|---|---|---|")
    for terrain in ("loop", "cross", "zigzag", "maze"):
        run = measured(seconds, seed, "fleet.size=8", f"environment.terrain={terrain}", LARGE_MAPS)
        own = [host for host in run.simulation.graph.hosts if host.name != WORKSTATION]
        received, sent = (sum(getattr(host, key) for host in own) / len(own) / run.seconds
                          for key in ("rx_bytes", "tx_bytes"))
        everything = sum(run.bytes.values())
        print(f"| {terrain} | {run.seconds:.0f} s | {received / 1e3:.0f} kB/s | "
              f"{sent / 1e3:.0f} kB/s | {everything / 1e9:.2f} GB |")


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    tables = {"account": account, "fleets": fleets, "terrains": terrains}
    parser.add_argument("table", choices=tables, nargs="?", default="account")
    parser.add_argument("--seconds", type=float, default=300.0)
    parser.add_argument("--seed", type=int, default=1)
    given = parser.parse_args()
    tables[given.table](given.seconds, given.seed)


if __name__ == "__main__":
    main()
