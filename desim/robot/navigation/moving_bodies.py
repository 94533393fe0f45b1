"""Moving bodies near a robot: those that its lasers see, and teammates that tell their poses."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from desim.ports import Peer
from desim.ports.local_planners import NearbyBody
from desim.robot.navigation.global_costmap import LETHAL, GlobalCostmap
from desim.robot.team import Team
from desim.units import NS_PER_S

# Our choices, in the order of what they are for: points, clusters, tracks, teammates.
_WITHIN_M = 5.0
_GAP_M = 0.3  # between two bodies
_FEWEST = 2  # points of a body
_SLACK_M = 0.15  # by which a cluster may be wider than a body
_STEP_M = 0.6  # of a body between two scans
_LOST_NS = NS_PER_S // 2  # after which a track without points ends
_MOVES_MPS = 0.15
_FRESH_NS = 3 * NS_PER_S // 2  # the age of a teammate's pose
_SAME_M = 0.8  # between that pose and a track that is the same body


@dataclass(eq=False)
class _Track:
    """A body that lasers see: its place (m), velocity (m/s), and when it was seen last."""

    place: np.ndarray
    velocity: np.ndarray
    seen_ns: int
    times: int = 1

    def at(self, now_ns: int) -> np.ndarray:
        return self.place + (now_ns - self.seen_ns) / NS_PER_S * self.velocity


class MovingBodies:
    """Follows what lasers see on no known obstacle and no wider than a robot of ``radius_m``, and
    the poses in ``team``. Two poses of a teammate make a velocity."""

    def __init__(self, team: Team, around: GlobalCostmap, radius_m: float) -> None:
        self._team, self._around, self._radius_m = team, around, radius_m
        self._tracks: list[_Track] = []
        self._heard: dict[str, tuple[Peer, np.ndarray]] = {}  # the last pose, and a velocity

    def observe(self, points: np.ndarray, here: np.ndarray, now_ns: int) -> None:
        """Take in the ``points`` [k, 2] of a scan, in the order of beams, seen from ``here``."""
        self._tracks = [one for one in self._tracks if now_ns - one.seen_ns <= _LOST_NS]
        free = list(self._tracks)
        for place in self._places(points, here):
            known = min(free, key=lambda one: float(np.hypot(*(one.at(now_ns) - place))),
                        default=None)
            if known is None or np.hypot(*(known.at(now_ns) - place)) > _STEP_M:
                self._tracks.append(_Track(place, np.zeros(2), now_ns))
                continue
            free.remove(known)
            passed_s = (now_ns - known.seen_ns) / NS_PER_S
            if passed_s > 0.0:
                known.velocity = (place - known.place) / passed_s
                known.place, known.seen_ns, known.times = place, now_ns, known.times + 1

    def around(self, here: np.ndarray, now_ns: int) -> list[NearbyBody]:
        """Those that move near ``here`` [2], now. What lasers see counts; an announced pose counts
        where they see nothing."""
        announced = self._announced(here, now_ns)
        found = []
        for track in self._tracks:
            place = track.at(now_ns)
            same = [one for one in announced
                    if np.hypot(one.x_m - place[0], one.y_m - place[1]) <= _SAME_M]
            announced = [one for one in announced if one not in same]
            velocity = np.array(same[0][3:5]) if same and track.times == 1 else track.velocity
            found.append(self._body(same[0].name if same else "", place, velocity))
        return [one for one in (*found, *announced) if np.hypot(one.x_mps, one.y_mps) > _MOVES_MPS]

    def _announced(self, here: np.ndarray, now_ns: int) -> list[NearbyBody]:
        found = []
        for name, peer in self._team.peers.items() if self._team.common_frame else ():
            last, velocity = self._heard.get(name, (peer, np.zeros(2)))
            if peer[:3] != last[:3]:
                passed_s = max((peer.heard_ns - last.heard_ns) / NS_PER_S, 1e-3)
                velocity = np.array([peer.x_m - last.x_m, peer.y_m - last.y_m]) / passed_s
            elif peer.heard_ns > last.heard_ns:
                velocity = np.zeros(2)
            self._heard[name] = peer, velocity
            age_ns = now_ns - peer.heard_ns
            place = np.array([peer.x_m, peer.y_m]) + age_ns / NS_PER_S * velocity
            if age_ns <= _FRESH_NS and np.hypot(*(place - here)) <= _WITHIN_M:
                found.append(self._body(name, place, velocity))
        return found

    def _body(self, name: str, place: np.ndarray, velocity: np.ndarray) -> NearbyBody:
        return NearbyBody(name, float(place[0]), float(place[1]), float(velocity[0]),
                          float(velocity[1]), self._radius_m)

    def _places(self, points: np.ndarray, here: np.ndarray) -> list[np.ndarray]:
        """The middles of the discs whose near sides are among ``points``."""
        near = points[np.hypot(*(points - here).T) <= _WITHIN_M]
        near = near[~self._known(near)]
        if not len(near):
            return []
        ends = np.flatnonzero(np.hypot(*np.diff(near, axis=0).T) > _GAP_M) + 1
        found = []
        for body in np.split(near, ends):
            wide_m = float(np.hypot(*(body[-1] - body[0])))
            if len(body) >= _FEWEST and wide_m <= 2.0 * self._radius_m + _SLACK_M:
                middle = body.mean(axis=0)
                away = middle - here
                # The mean depth of a half disc's rim across the view is pi / 4 of its radius.
                found.append(middle + 0.25 * np.pi * self._radius_m / np.hypot(*away) * away)
        return found

    def _known(self, points: np.ndarray) -> np.ndarray:
        """[k] whether a point is on an obstacle of the map, or beside its cell."""
        spec, values = self._around.spec, self._around.values
        column, row = np.floor((points - (spec.x_m, spec.y_m)) / spec.resolution_m).astype(int).T
        column, row = np.clip(column + 1, 1, spec.width), np.clip(row + 1, 1, spec.height)
        return np.any([values[row + r, column + c] == LETHAL
                       for r in (-1, 0, 1) for c in (-1, 0, 1)], axis=0)
