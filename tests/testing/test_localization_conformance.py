"""The kit's check of localization: ours pass, and what breaks the contract is named."""

import math
import random
from itertools import takewhile

import numpy as np
import pytest

from desim import plugins
from desim.errors import ModelError
from desim.ports import Pose2D
from desim.ports.localization import LocalizationTraits
from desim.robot.localization.kinds.odometry import DeadReckoning
from desim.robot.localization.kinds.scan_matching import ScanMatching
from desim.testing import check_localization
from desim.testing.localization_checks import scan_of

KINDS = sorted(set(plugins.available("localization")) - {"ground_truth"})


@pytest.mark.parametrize("name", KINDS)
def test_every_kind_keeps_its_contract(name):
    check_localization(plugins.load("localization", name))


def test_the_kind_that_has_the_truth_has_no_pose_of_readings():
    with pytest.raises(ModelError, match="^ground_truth has no pose of odometry$"):
        check_localization(plugins.load("localization", "ground_truth"))


def test_scans_of_the_room_are_exact():
    ranges = scan_of(np.array((2.0, 2.0, 0.0)))
    assert ranges[90] == pytest.approx(10.0)  # ahead, the wall at x = 12 m
    assert ranges[90 + 20] == pytest.approx(3.0 / math.cos(0.5))  # the block, at x = 5 m
    assert ranges[90 + 63] == pytest.approx(6.0 / math.sin(63 * 0.025))  # the wall at y = 8 m
    assert not ranges.flags.writeable


def test_scans_are_taken_where_the_robot_is_and_not_where_its_odometer_says():
    read = []

    class Notes(DeadReckoning):
        def on_odometry(self, context, odometry, scan):
            if scan is not None:
                read.append((odometry, scan.ranges))
            return odometry

    check_localization(Notes)
    drive = list(takewhile(lambda one: len(set(one[1])) > 1, read))  # until nothing is in sight
    ranges = scan_of(np.array((2.0, 2.08, -math.pi / 2)))  # a step before the end of both rounds
    places = [odometry for odometry, seen in drive if np.allclose(seen, ranges)]
    assert len(places) == 2
    assert all(math.hypot(x_m - 2.0, y_m - 2.08) > 0.01 for x_m, y_m, _ in places)


class Lost(DeadReckoning):
    def on_odometry(self, context, odometry, scan):
        return Pose2D(math.nan, 0.0, 0.0) if context.now_ns > 10**9 else odometry


class Array(DeadReckoning):
    def on_odometry(self, context, odometry, scan):
        return np.array(odometry)


class Backwards(DeadReckoning):
    def on_odometry(self, context, odometry, scan):
        return Pose2D(-odometry.x_m, odometry.y_m, odometry.yaw_rad)


class Shared(DeadReckoning):
    readings: list = []

    def on_odometry(self, context, odometry, scan):
        self.readings.append(odometry)
        return Pose2D(odometry.x_m + 1e-9 * len(self.readings), *odometry[1:])


class Throws(DeadReckoning):
    def on_odometry(self, context, odometry, scan):
        return Pose2D(odometry.x_m + 1e-9 * random.random(), *odometry[1:])


class Draws(DeadReckoning):
    def on_odometry(self, context, odometry, scan):
        if scan is not None:
            context.draw(scan, odometry)
        return odometry


class Twice(Draws):
    traits = LocalizationTraits(draws_map=True)

    def on_odometry(self, context, odometry, scan):
        super().on_odometry(context, odometry, scan)
        return super().on_odometry(context, odometry, scan)


class Blank(DeadReckoning):
    traits = LocalizationTraits(draws_map=True)


@pytest.mark.parametrize(("cls", "says"), [
    (Lost, r"return a Pose2D of three finite numbers, not Pose2D\(x_m=nan"),
    (Array, r"return a Pose2D of three finite numbers, not array\("),
    (Backwards, r"be about as good as the odometry in a room: 1\d\.\d\d m and "),
    (Shared, r"keep its state in self: Shared.readings changed, and all robots share it$"),
    (Throws, "draw from context.stream.* only, not from random or numpy.random$"),
    (Draws, "declare traits = LocalizationTraits.draws_map=True., as it draws$"),
    (Twice, "draw the scan that has just come, and once$"),
    (Blank, "draw scans, as its traits say draws_map: context.draw$"),
])
def test_the_kit_names_what_is_wrong(cls, says):
    with pytest.raises(AssertionError, match=rf"{cls.__name__} must {says}"):
        check_localization(cls)


class Short(ScanMatching):
    def _redraw(self, context):
        context.redraw(np.zeros((len(self.filter.history) + 1, 3)))


def test_a_new_drawing_has_one_pose_for_each_scan():
    with pytest.raises(ModelError, match=r"Short \(.*\) draws the map anew with float64 "
                                         r"\[2, 3\]; wanted: finite poses \[1, 3\], one for "):
        check_localization(Short)


class Scribbles(DeadReckoning):
    def on_odometry(self, context, odometry, scan):
        if scan is not None:
            scan.ranges[0] = 0.0
        return odometry


def test_scans_are_not_to_be_changed():
    with pytest.raises(ModelError, match=(
            r"Scribbles \(.*\) writes into what it may only read, as scans are \(ValueError: "
            r"assignment destination is read-only\); wanted: a copy$")):
        check_localization(Scribbles)
