"""The group ``delivery``: robots at one picker, as machines at one repairman.

That is a closed network of queues whose throughput is known."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Literal

import numpy as np

from desim.engine.kernel import Kernel, Phase
from desim.engine.streams import Streams
from desim.errors import ModelError
from desim.monitor.tasks.delivery import Deliveries
from desim.ports import GridSpec
from desim.ports.cases import Check, Play
from desim.ports.delivery import Serve, Served
from desim.ports.tasks import Ground, Knowledge, TaskContext
from desim.units import NS_PER_S

_TRAVEL_S, _SERVICE_S, _ORDERS = 60.0, 20.0, 20_000
_TOLERANCE = 0.03
_PICK, _DROP = (1.0, 1.0), (9.0, 1.0)
_SIDE = 20  # cells of 0.5 m


class Shuttles:
    """A ``TaskContext`` of robots that need a time of ``travel_s`` on average from the drop to the
    pick, constant or exponential, and none back; the next order is always there."""

    def __init__(self, robots: int, travel: Literal["fixed", "exponential"]) -> None:
        self.kernel, self._travel, self._streams = Kernel(), travel, Streams(1)
        self.robots = self.explorers = tuple(f"robot_{k}" for k in range(robots))
        self.started_ns, self.radius_m = 0, 0.2
        self.desks: tuple[str, ...] = ()
        self.stop_explored, self.reason = 1.0, ""
        self.stop_by: Literal["any", "union", "all", "none"] = "none"
        solid = np.zeros((_SIDE, _SIDE), np.uint8)
        self.ground = Ground(GridSpec(0.5, _SIDE, _SIDE, 0.0, 0.0), solid, solid == 0)
        self._poses = np.full((robots, 3), 1.0)
        self._next = 0  # order that nobody has
        self.task = Deliveries(Deliveries.Params(
            stations={"picker": {"kind": "pick", "at": _text(_PICK), "service": f"{_SERVICE_S} s"},
                      "drop": {"kind": "drop", "at": _text(_DROP), "service": "0 s"}},
            times="exponential", orders=[("0 s", "picker", "drop")] * (_ORDERS + 1000)))
        self.task.start(self)

    def throughput_per_s(self) -> float:
        """The orders that are done in a second, after many."""
        for robot in range(len(self.robots)):
            self._set_out(robot)
        while self.task.measure()["orders_done"] < _ORDERS:
            self.kernel.run(self.kernel.now_ns + 1000 * NS_PER_S)
        return self.task.measure()["orders_done"] / self.kernel.now_ns * NS_PER_S

    def notify(self, host: str, content: object) -> None:
        if not isinstance(content, Served):
            return
        robot = self.robots.index(host)
        if content.station == "drop":
            self._set_out(robot)
        else:
            self._serve(robot, _DROP, Serve("drop"))

    def _set_out(self, robot: int) -> None:
        travel_s = _TRAVEL_S if self._travel == "fixed" else float(
            self._streams("travel", robot).exponential(_TRAVEL_S))
        self._next += 1
        order = self._next - 1
        self.after(round(travel_s * NS_PER_S),
                   lambda _: self._serve(robot, _PICK, Serve("picker", order)))

    def _serve(self, robot: int, at_m: tuple[float, float], serve: Serve) -> None:
        self._poses[robot, :2] = at_m
        self.task.on_act(self, self.robots[robot], serve)

    # ------------------------------------------------------------------------- see TaskContext

    @property
    def now_ns(self) -> int:
        return self.kernel.now_ns

    @property
    def knowledge(self) -> Knowledge:
        raise ModelError("shuttles know nothing")

    def poses(self) -> np.ndarray:
        return self._poses

    def travelled_m(self) -> np.ndarray:
        return np.zeros(len(self.robots))

    def every(self, period_ns: int, callback: Callable[[TaskContext], object]) -> None:
        raise ModelError("shuttles have no batteries")

    def after(self, delay_ns: int, callback: Callable[[TaskContext], object]) -> None:
        self.kernel.after(delay_ns, Phase.OBSERVE, 0, lambda _: callback(self))

    def energy_j(self) -> np.ndarray:
        return np.full(len(self.robots), np.nan)

    battery_j = energy_j

    def hold(self, robot: str) -> None:
        raise ModelError("shuttles have no batteries")

    def record(self, kind: str, robot: str | None, a: int = 0, b: int = 0) -> None:
        """Nobody reads it."""

    def end(self, reason: str) -> None:
        self.reason = reason

    def stream(self, *name: str | int) -> np.random.Generator:
        return self._streams("task", *name)


def machines_at_one_repairman(count: int, up_s: float, repair_s: float) -> float:
    """The repairs in a second: (1 - p0) / repair_s, where p0 = 1 / sum over n of
    count! / (count - n)! (repair_s / up_s)^n is the probability that all run (Palm 1947; Kleinrock,
    Queueing Systems 1, 1975, 3.8). It depends on the mean of the up times alone (Baskett, Chandy,
    Muntz, Palacios 1975)."""
    weight = total = 1.0
    for n in range(1, count + 1):
        weight *= (count - n + 1) * repair_s / up_s
        total += weight
    return (1.0 - 1.0 / total) / repair_s


class MachinesOfOneRepairman:
    """Robots that bring loads from one picker, whose services are exponential."""

    source = "M/M/1//N (Palm 1947; Kleinrock 1975, section 3.8)"

    def checks(self, play: Play) -> Iterator[Check]:
        for travel in ("fixed", "exponential"):
            for count in (1, 2, 4, 8):
                expected = 3600 * machines_at_one_repairman(count, _TRAVEL_S, _SERVICE_S)
                measured = 3600 * Shuttles(count, travel).throughput_per_s()
                yield Check(f"{count} robots, travel {travel}", measured, expected,
                            _TOLERANCE * expected, "/h")


def _text(at_m: tuple[float, float]) -> tuple[str, str]:
    return f"{at_m[0]} m", f"{at_m[1]} m"
