"""The walls of a network case, and the places of its hosts, which stand or move."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from desim.errors import InputError, did_you_mean
from desim.network.surroundings import Still
from desim.ports import Obstacles, antenna, materials
from desim.ports.antenna import Antenna
from desim.ports.cases import Setup, Waypoint
from desim.units import DURATION
from desim.world.obstacles import toll
from desim.world.sources import MAX_SIDE_M, by_kind, matter_of

_BOUNDS = (-MAX_SIDE_M / 2, -MAX_SIDE_M / 2, MAX_SIDE_M / 2, MAX_SIDE_M / 2)  # of walls


class SetupPlaces(Still):
    """The walls of ``setup``, and the places of its ``hosts`` in order. Raises ``InputError`` for a
    wall or a motion that cannot be, and for unknown hosts."""

    def __init__(self, setup: Setup, hosts: tuple[str, ...]) -> None:
        super().__init__(np.array([setup.places[host] for host in hosts]))
        self.antennas = antenna.table(setup.antennas.get(host, Antenna()) for host in hosts)
        if setup.terrain.walls:
            walls = matter_of(by_kind(setup.terrain.walls, ".terrain.walls", _BOUNDS), None)
            self.obstacles = Obstacles(*walls[:4], materials.NAMES, 0, walls.crossing, walls.block,
                                       toll)
        for key, named in (("motion", setup.motion), ("antennas", setup.antennas)):
            for host in named:
                if host not in hosts:
                    raise InputError(f".{key}: no host {host!r}{did_you_mean(host, hosts)}; hosts "
                                     f"are {', '.join(hosts)}")
        self._moving = {hosts.index(host): _way(host, setup.places[host], way)
                        for host, way in setup.motion.items()}

    def positions(self, time_ns: int) -> np.ndarray:
        if not self._moving:
            return self._positions
        places = self._positions.copy()
        for host, (at_ns, *way_m) in self._moving.items():
            places[host] = [np.interp(time_ns, at_ns, column) for column in way_m]
        places.flags.writeable = False
        return places


def _way(host: str, place: tuple[float, float], waypoints: Sequence[Waypoint]) -> np.ndarray:
    """[3, n] ns, x m, y m of the way points of ``host``, from its ``place`` on."""
    way = [(0, *place), *waypoints]
    if way[:1] == way[1:2]:
        del way[0]
    first = len(waypoints) - len(way) + 1
    for k, ((before_ns, *_), (at_ns, *_)) in enumerate(pairwise(way), first):
        if at_ns <= before_ns:
            raise InputError(f".motion.{host}.{k}.0: a way point's time must be later than "
                             f"{DURATION.format(before_ns)}, that of the one before (0 s: of its "
                             f"place), got {DURATION.format(at_ns)}")
    return np.array(way).T
