"""The energy that robots use: a sum over their parts of power times the time in each state.

Each time is a counter that another part keeps anyway. So nothing is integrated in steps, and no
event is booked:

    drive   = idle t + motion d          t: the software has run, d: way driven
    sensors = sensors t
    compute = idle t + processor b       b: processors were busy, summed over them
    radio   = idle (t - r - s) + receive r + send s      r, s: of t, receiving and sending

Motors whose power is a line over speed, P = idle + motion v, use idle t + motion d on any way: the
integral of v is d.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np

from desim.errors import ModelError, class_of
from desim.middleware.host import Host
from desim.monitor.meters.meter import Meter, Second
from desim.monitor.samples import Sample
from desim.network.medium import Medium
from desim.ports import CountsAirtime
from desim.robot.mapping.robot_map import RobotMap
from desim.scenario.schema.power import PowerParams, RadioPower
from desim.units import NS_PER_S

PARTS = ("drive_j", "sensors_j", "compute_j", "radio_j")


class EnergyUse(Meter):
    """The energy that ``hosts``, robots in index order, use. ``powers``: what the parts of each
    draw; None: its energy is not measured. ``travelled_m()`` gives [robots] m."""

    def __init__(self, hosts: Sequence[Host], powers: Sequence[PowerParams | None],
                 travelled_m: Callable[[], np.ndarray]) -> None:
        self._metered = [(i, host, power) for i, (host, power)
                         in enumerate(zip(hosts, powers, strict=True)) if power is not None]
        self._names, self._travelled_m = [host.name for host in hosts], travelled_m
        # How long the software of each has run, and its airtimes in that time. While it runs: less
        # what the clock and the counters showed at its start; ``joules`` adds what they show now.
        self._ran = {host.name: (0, np.zeros(2)) for _, host, _ in self._metered}
        self._running: set[str] = set()

    def watch(self, robot: str, robot_map: RobotMap | None, now_ns: int) -> None:
        runs = robot_map is not None
        if robot not in self._ran or runs == (robot in self._running):
            return
        i = list(self._ran).index(robot)
        airtime_s, sign = self._airtimes_s()[i], -1 if runs else 1
        ran_ns, in_that_s = self._ran[robot]
        self._ran[robot] = ran_ns + sign * now_ns, in_that_s + sign * airtime_s
        self._running ^= {robot}

    def joules(self, now_ns: int) -> np.ndarray:
        """[robots, 4] J so far, by ``PARTS``; NaN of robots whose energy is not measured."""
        used = np.full((len(self._names), len(PARTS)), np.nan)
        travelled_m = self._travelled_m()
        for (i, host, power), shown_s in zip(self._metered, self._airtimes_s(), strict=True):
            ran_ns, airtime_s = self._ran[host.name]
            if host.name in self._running:
                ran_ns, airtime_s = ran_ns + now_ns, airtime_s + shown_s
            ran_s = ran_ns / NS_PER_S
            used[i] = (power.base.idle_w * ran_s + power.base.motion_jpm * travelled_m[i],
                       power.sensors_w * ran_s,
                       power.computer.idle_w * ran_s + power.computer.processor_w * _busy_s(host),
                       _radio_j(power.radio, ran_s, *airtime_s.tolist()))
        return used

    def _airtimes_s(self) -> np.ndarray:
        """[metered, 2] s of sending and receiving so far, by the counters of the media."""
        return _airtimes_s([host for _, host, _ in self._metered],
                           [power.radio.rate_bps for *_, power in self._metered])

    def quantities(self, now_ns: int) -> Sample:
        """The energy of all robots so far; none where it is not measured."""
        if not self._metered:
            return {}
        used = self.joules(now_ns)[[i for i, *_ in self._metered]]
        return {"energy_j": math.fsum(used.ravel().tolist())}

    def track(self, second: Second) -> Sample:
        return {"energy_j": self.joules(second.now_ns).sum(axis=1)} if self._metered else {}

    def by_host(self, now_ns: int) -> dict[str, Sample]:
        """The energy of each robot, that of its parts, and how long its battery would last at the
        mean power of the run; None where it is not measured."""
        summaries: dict[str, Sample] = {
            name: dict.fromkeys(("energy_j", *PARTS, "battery_life_s")) for name in self._names}
        used = self.joules(now_ns)
        for i, host, power in self._metered:
            energy_j = float(used[i].sum())
            summaries[host.name] = {
                "energy_j": energy_j, **dict(zip(PARTS, used[i].tolist(), strict=True)),
                "battery_life_s": power.battery_j / energy_j * now_ns / NS_PER_S
                if energy_j else None}
        return summaries

    def summary(self, now_ns: int) -> Sample:
        """The sums over the robots whose energy is measured; None without any."""
        measured = [own for own in self.by_host(now_ns).values() if own["energy_j"] is not None]
        return {key: math.fsum(own[key] for own in measured) if measured else None
                for key in ("energy_j", *PARTS)}


def _busy_s(host: Host) -> float:
    """The time for which processors have been busy; 0 on an ideal computer."""
    return 0.0 if host.computer is None else host.computer.processors.busy_ns() / NS_PER_S


def _airtimes_s(hosts: Sequence[Host], rates_bps: Sequence[int]) -> np.ndarray:
    """[hosts, 2] s for which the interfaces of each were sending and receiving. If a network model
    does not count that, it is the bytes on the wire over a rate."""
    airtimes_s = np.zeros((len(hosts), 2))
    for medium in {id(medium): medium for host in hosts for medium in host.media}.values():
        known_s = _counted_s(medium)
        for i, (host, rate_bps) in enumerate(zip(hosts, rates_bps, strict=True)):
            k = host.index
            if k in known_s:
                airtimes_s[i] += known_s[k]
            elif medium in host.media:
                airtimes_s[i] += (8 * medium.tx_bytes[k] / rate_bps,
                                  8 * medium.rx_bytes[k] / rate_bps)
    return airtimes_s


def _counted_s(medium: Medium) -> dict[int, np.ndarray]:
    """The times of sending and receiving by host, none where the network model does not know."""
    model, hosts = medium.model, medium.attached
    if not isinstance(model, CountsAirtime):
        return {}
    airtimes_ns = np.asarray(model.airtime_ns(hosts))
    if airtimes_ns.shape != (len(hosts), 2) or airtimes_ns.dtype.kind not in "iu":
        raise ModelError(f"{class_of(model)} has the airtimes {airtimes_ns.tolist()!r}; wanted: a "
                         "pair of whole nanoseconds for each host")
    return dict(zip(hosts, airtimes_ns / NS_PER_S, strict=True))


def _radio_j(radio: RadioPower, ran_s: float, sent_s: float, received_s: float) -> float:
    return (radio.idle_w * ran_s + (radio.receive_w - radio.idle_w) * received_s
            + (radio.send_w - radio.idle_w) * sent_s)
