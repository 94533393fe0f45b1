"""Checks of localization: does a class keep its contract?"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from desim.engine.streams import Streams
from desim.ports import Pose2D
from desim.ports.localization import Localization, LocalizationTraits
from desim.robot.transforms import compose, motion_between, wrapped
from desim.testing.advice import PluginClass, check_form, made, need
from desim.testing.checks import own_streams
from desim.testing.localization_bench import DRIFT, LASER, BenchScan, LocalizationBench
from desim.testing.shared_state import own_state

_PERIOD_NS = 100_000_000  # of the odometer and the laser
_STEP_M, _STEP_RAD = 0.08, 0.1  # a period
_CORNERS = [(2.0, 2.0), (10.0, 2.0), (10.0, 6.0), (2.0, 6.0), (2.0, 2.0)]
_SLACK_M, _SLACK_RAD = 0.1, 0.03  # an error that may be larger than odometry's by so much
_FINE_ROUNDS, _STILL, _BLIND = 2, 20, 20  # rounds, readings, readings


def _box(x0: float, y0: float, x1: float, y1: float) -> list[tuple[float, ...]]:
    return [(x0, y0, x1, y0), (x1, y0, x1, y1), (x1, y1, x0, y1), (x0, y1, x0, y0)]


# x m, y m of both ends: a room with a block and a cupboard, which make its corners differ.
WALLS = np.array(_box(0.0, 0.0, 12.0, 8.0) + _box(5.0, 3.2, 7.5, 4.6) + _box(0.0, 7.0, 1.4, 8.0))


class _Reading(NamedTuple):
    """The readings of one instant; the truth stays behind."""

    odometry: Pose2D
    scan: BenchScan | None


def check_localization(cls: PluginClass[Localization], **params: object) -> None:
    """Check a ``ports.localization.Localization``. A robot stands in a room without scans, then
    with them, and drives twice around a block: its error must not exceed that of the odometry by
    more than 0.1 m and 0.03 rad. Then all beams read the longest range, scans come late and twice,
    nothing is read for a while, and the odometry jumps; a restart follows, where no start is known.
    Poses must be finite and the same once more. All readings are made beforehand: nothing that the
    plug-in could reach has the truth. A robot among strangers that say nothing, as where the
    network is cut, must be as good, and place none of them."""
    check_form("localization", cls, params)
    true = _way()
    odometry = _odometry(true)
    fine, rough = _fine(true, odometry), _rough(true, odometry)
    with own_streams(cls), own_state(cls):
        played = [_play(cls, params, fine, rough) for _ in range(2)]
    need(played[0][0] == played[1][0], cls, "come to the same poses of the same readings: keep "
                                            "state in self, and iterate over no set")
    steps = len(true)
    alone = LocalizationBench(made(cls, params), fine[0].odometry, strangers=("robot_2",))
    _read(alone, fine, 0)
    need(not alone.places, cls, "place a stranger by what it has said, and not before")
    own_m, own_rad = _errors(odometry, true)
    for poses, where in ((played[0][1], "in a room"), (alone.poses, "among silent strangers")):
        found_m, found_rad = _errors(np.array(poses[-steps:]), true)
        need(found_m <= own_m + _SLACK_M and found_rad <= own_rad + _SLACK_RAD, cls,
             f"be about as good as the odometry {where}: {found_m:.2f} m and {found_rad:.2f} rad "
             f"off on average, the odometry {own_m:.2f} m and {own_rad:.2f} rad")


def _way() -> np.ndarray:
    """True poses [n, 3] around the block, turning on the spot."""
    poses: list[tuple[float, float, float]] = []
    yaw = 0.0
    for (x0, y0), (x1, y1) in zip(_CORNERS[:-1] * _FINE_ROUNDS, _CORNERS[1:] * _FINE_ROUNDS,
                                  strict=True):
        turn = math.remainder(math.atan2(y1 - y0, x1 - x0) - yaw, math.tau)
        count = math.ceil(abs(turn) / _STEP_RAD)
        poses += [(x0, y0, yaw + turn * k / count) for k in range(count)]
        yaw += turn
        count = round(math.hypot(x1 - x0, y1 - y0) / _STEP_M)
        poses += [(x0 + (x1 - x0) * k / count, y0 + (y1 - y0) * k / count, yaw)
                  for k in range(count)]
    return np.array(poses)


def _odometry(true: np.ndarray) -> np.ndarray:
    """[n, 3] dead reckoning: each true motion with errors, as the context says."""
    sigmas = (DRIFT.position_m, DRIFT.position_m, DRIFT.heading_rad)
    motions = motion_between(true[:-1], true[1:])
    poses = [true[0]]
    for motion in motions + Streams(0)("odometry").normal(0.0, sigmas, motions.shape):
        poses.append(compose(poses[-1], motion))
    return np.array(poses)


def scan_of(pose: np.ndarray) -> np.ndarray:
    """Ranges [beams] m of the room's walls from a pose [3]: exact, the longest range where nothing
    is near enough. They cannot be changed."""
    beams = round(-2.0 * LASER.angle_min_rad / LASER.increment_rad) + 1
    angles = pose[2] + LASER.angle_min_rad + LASER.increment_rad * np.arange(beams)
    ux, uy = np.cos(angles)[:, None], np.sin(angles)[:, None]
    ax, ay = WALLS[:, 0] - pose[0], WALLS[:, 1] - pose[1]
    wx, wy = WALLS[:, 2] - WALLS[:, 0], WALLS[:, 3] - WALLS[:, 1]
    across = ux * wy - uy * wx  # 0 along a wall
    with np.errstate(divide="ignore", invalid="ignore"):
        along, part = (ax * wy - ay * wx) / across, (ax * uy - ay * ux) / across
    along[~((part >= 0.0) & (part <= 1.0) & (along > 0.0))] = np.inf
    return _fixed(np.minimum(along.min(axis=1), LASER.longest_m))


def _fixed(ranges: np.ndarray) -> np.ndarray:
    ranges.setflags(write=False)
    return ranges


def _fine(true: np.ndarray, odometry: np.ndarray) -> list[_Reading]:
    """Standing without scans, standing with them, and the way."""
    first = Pose2D(*odometry[0].tolist())
    return [*[_Reading(first, None)] * _STILL,
            *[_Reading(first, BenchScan(first, scan_of(true[0])))] * _STILL,
            *(_at(pose, place) for pose, place in zip(true, odometry, strict=True))]


def _at(true: np.ndarray, odometry: np.ndarray) -> _Reading:
    at = Pose2D(*odometry.tolist())
    return _Reading(at, BenchScan(at, scan_of(true)))


def _rough(true: np.ndarray, odometry: np.ndarray) -> list[_Reading]:
    """No returns, late and duplicate scans, no scans, and a jump of the odometry."""
    return list(_mishaps(true, odometry))


def _mishaps(true: np.ndarray, odometry: np.ndarray) -> Iterator[_Reading]:
    quarter = len(true) // 4
    nothing = _fixed(np.full(len(scan_of(true[0])), LASER.longest_m))
    for k in range(quarter):  # nothing in sight
        at = Pose2D(*odometry[k].tolist())
        yield _Reading(at, BenchScan(at, nothing))
    for k in range(quarter, 2 * quarter):  # late by one reading, and twice
        late = BenchScan(Pose2D(*odometry[k - 1].tolist()), scan_of(true[k - 1]))
        yield from [_Reading(Pose2D(*odometry[k].tolist()), late)] * 2
    for k in range(2 * quarter, 2 * quarter + _BLIND):
        yield _Reading(Pose2D(*odometry[k].tolist()), None)
    for k in range(2 * quarter + _BLIND, 3 * quarter):  # after a jump
        yield _at(true[k], odometry[k] + (3.0, -2.0, 1.0))


def _play(cls: PluginClass[Localization], params: dict[str, object], fine: list[_Reading],
          rough: list[_Reading]) -> tuple[bytes, list[Pose2D]]:
    """All that was returned and drawn, and the poses of the fine part."""
    localization = made(cls, params)
    bench = LocalizationBench(localization, fine[0].odometry)
    now_ns = _read(bench, fine, 0)
    poses = list(bench.poses)
    need(bool(bench.drawn) or not LocalizationTraits.of(cls).draws_map, cls,
         "draw scans, as its traits say draws_map: context.draw")
    now_ns = _read(bench, rough, now_ns)
    again = LocalizationBench(made(cls, params), None, now_ns)
    _read(again, fine[:len(fine) // 4] + rough, now_ns)
    numbers = [np.array(part).ravel() for one in (bench, again)
               for part in (one.poses, one.drawn, *one.redrawn)]
    return np.concatenate(numbers).tobytes(), poses


def _read(bench: LocalizationBench, readings: list[_Reading], now_ns: int) -> int:
    for odometry, scan in readings:
        now_ns += _PERIOD_NS
        bench.read(now_ns, odometry, scan)
    return now_ns


def _errors(found: np.ndarray, true: np.ndarray) -> tuple[float, float]:
    """The mean errors of place (m) and heading (rad)."""
    places_m = np.hypot(*(found[:, :2] - true[:, :2]).T)
    return float(places_m.mean()), float(np.abs(wrapped(found[:, 2] - true[:, 2])).mean())
