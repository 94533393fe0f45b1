"""The odometry and the loops of a CARMEN log whose poses gmapping has corrected.

    python tools/measurements/corrected_log.py infinite-corridor-corrected.log.gz --to killian
    desim slam killian.log --relations killian.relations --localization pose_graph

Such logs (Radish's, as in acschaefer/ple under data/carmen) have a line FLASER for each scan that
gmapping has processed, at the pose that it found. The lines ODOM after it go on from there by the
odometry, up to the instant of the next scan. So the odometry is what these lines add up to. It goes
into a log for ``desim slam``, which counts scans as seconds, as stamps are damaged in some.

The relations are between scans of the same place and heading at the ends of loops, by the poses of
gmapping. They measure whether a loop closes where gmapping has closed it.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np

from desim.robot.transforms import compose, motion_between, wrapped
from desim.unpacking import lines

WITHIN_M, ALIKE_RAD, APART = 2.0, 0.6, 60  # pairs: how near, how much turned, scans between


def read(path: Path) -> tuple[list[str], np.ndarray, np.ndarray]:
    """The ranges of each scan (their number first), its odometry and its corrected pose [n, 3]."""
    scans: list[str] = []
    odometry, corrected = [np.zeros(3)], []
    base = last = None  # the corrected pose of the last scan, and where the odometry has led since
    for _, line in lines(path):
        words = line.decode("ascii", "replace").split()
        if words[:1] == ["ODOM"]:
            last = np.array(words[1:4], float)
        elif words[:1] == ["FLASER"]:
            end = 2 + int(words[1])
            if base is not None and last is not None:
                odometry.append(compose(odometry[-1], motion_between(base, last)))
            base = last = np.array(words[end:end + 3], float)
            scans.append(" ".join(words[1:end]))
            corrected.append(base)
    return scans, np.array(odometry), np.array(corrected)


def loops(poses: np.ndarray) -> list[tuple[int, int]]:
    """The pairs of scans at the ends of loops, by their ``poses`` [n, 3]."""
    pairs = []
    for k in range(APART, len(poses)):
        before = poses[:k - APART + 1]
        near = np.hypot(*(before[:, :2] - poses[k, :2]).T) < WITHIN_M
        alike = np.abs(wrapped(before[:, 2] - poses[k, 2])) < ALIKE_RAD
        pairs += [(int(first), k) for first in np.flatnonzero(near & alike)]
    return pairs


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("log", type=Path)
    parser.add_argument("--to", type=Path, required=True, help="the names of both files, less .log")
    given = parser.parse_args()
    scans, odometry, corrected = read(given.log)
    with given.to.with_suffix(".log").open("w") as log:
        for k, (ranges, pose) in enumerate(zip(scans, odometry, strict=True)):
            place = " ".join(f"{value:.6f}" for value in pose)
            print("FLASER", ranges, place, place, k, "log", k, file=log)
    pairs = loops(corrected)
    with given.to.with_suffix(".relations").open("w") as relations:
        for first, second in pairs:
            x_m, y_m, yaw_rad = motion_between(corrected[first], corrected[second])
            print(first, second, f"{x_m:.6f} {y_m:.6f} 0 0 0 {yaw_rad:.6f}", file=relations)
    way_m = np.cumsum(np.r_[0.0, np.hypot(*np.diff(corrected[:, :2], axis=0).T)])
    lengths_m = sorted(way_m[second] - way_m[first] for first, second in pairs)
    ends = f"{lengths_m[0]:.0f} to {lengths_m[-1]:.0f} m" if pairs else "none"
    print(f"{len(scans)} scans, {way_m[-1]:.0f} m; {len(pairs)} relations, loops: {ends}")


if __name__ == "__main__":
    main()
