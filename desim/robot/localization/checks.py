"""Checks of the poses that a localization gives."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import TypeVar

import numpy as np

from desim.errors import ModelError, class_of, described
from desim.ports import Pose2D
from desim.ports.arguments import is_pose
from desim.ports.localization import Localization, LocalizationTraits

S = TypeVar("S")  # a scan with its odometry


@contextmanager
def writes_checked(localization: Localization) -> Iterator[None]:
    """Inside, ``localization`` runs. Raises ``ModelError`` if it writes into a scan."""
    try:
        yield
    except ValueError as error:
        if "read-only" not in str(error):
            raise
        raise ModelError(f"{class_of(localization)} writes into what it may only read, as scans "
                         f"are ({described(error)}); wanted: a copy"
                         ).with_traceback(error.__traceback__) from None


def checked_pose(localization: Localization, pose: object) -> Pose2D:
    """``pose``, which ``localization`` returned. Raises ``ModelError`` if it is no pose."""
    if not is_pose(pose):
        raise ModelError(f"{class_of(localization)} returned {pose!r} in on_odometry; wanted: a "
                         "Pose2D of three finite numbers")
    return pose


def drawable(localization: Localization, scan: object, last: S | None, pose: object) -> S:
    """``scan``, if ``localization`` draws maps, and draws from a pose the ``last`` scan, which was
    not drawn yet. Raises ``ModelError`` if not."""
    if not LocalizationTraits.of(localization).draws_map:
        raise ModelError(f"{class_of(localization)} draws a scan; wanted: traits = "
                         "LocalizationTraits(draws_map=True) in its class")
    if last is None or scan is not last:
        raise ModelError(f"{class_of(localization)} draws something else than the scan that has "
                         "just come, or that twice; wanted: that scan, once")
    if not is_pose(pose):
        raise ModelError(f"{class_of(localization)} draws a scan from {pose!r}; wanted: a Pose2D "
                         "of three finite numbers")
    return last


def checked_path(localization: Localization, poses: object, drawn: int) -> np.ndarray:
    """``poses``, if they are one finite pose for each of the ``drawn`` scans. Raises ``ModelError``
    if not."""
    if not (isinstance(poses, np.ndarray) and poses.shape == (drawn, 3)
            and poses.dtype.kind == "f" and np.isfinite(poses).all()):
        what = (f"{poses.dtype} {list(poses.shape)}" if isinstance(poses, np.ndarray)
                else f"{type(poses).__name__}")
        raise ModelError(f"{class_of(localization)} draws the map anew with {what}; wanted: finite "
                         f"poses [{drawn}, 3], one for each scan that was drawn")
    return poses
