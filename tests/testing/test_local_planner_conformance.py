"""The kit's check of local planners: ours pass, and what breaks the contract is named."""

import random

import pytest

from desim import plugins
from desim.robot.navigation.local_planners.dynamic_window import DynamicWindow
from desim.robot.navigation.local_planners.regulated_pure_pursuit import RegulatedPurePursuit
from desim.testing import check_local_planner

KINDS = sorted({*plugins.available("local_planner"), "dynamic_window", "dwb",
                "orca", "regulated_pure_pursuit"})


@pytest.mark.parametrize("name", KINDS)
def test_every_local_planner_keeps_its_contract(name):
    check_local_planner(plugins.load("local_planner", name))


def test_pursuit_keeps_it_with_a_scaled_lookahead():
    check_local_planner(RegulatedPurePursuit, scaled_lookahead=True, max_speed="0.5 m/s")


class Reckless(RegulatedPurePursuit):
    def _would_collide(self, context, speed_mps, turn_radps, carrot_m):
        return False


class Lazy(DynamicWindow):
    def steer(self, context):
        return 0.0, 0.0, super().steer(context)[2], True


class Terse(DynamicWindow):
    def steer(self, context):
        return super().steer(context)[:2]


class Undecided(DynamicWindow):
    def steer(self, context):
        return *super().steer(context)[:3], 0.5


class Lost(DynamicWindow):
    def steer(self, context):
        return float("nan"), *super().steer(context)[1:]


class Vandal(DynamicWindow):
    def steer(self, context):
        context.arrays.near2[:] = 1e6
        return super().steer(context)


class Moody(DynamicWindow):
    moods = []

    def steer(self, context):
        self.moods.append(1)
        return super().steer(context)


class Gambler(DynamicWindow):
    def steer(self, context):
        speed, *rest = super().steer(context)
        return speed * random.random(), *rest


BREACHES = [
    (Reckless, "touch nothing that the laser sees: it is at "),
    (Lazy, "arrive within 60 s, as nothing is in the way; 9.2 m are left"),
    (Terse, "return a tuple of a speed, a turn rate, a length >= 0, all finite, and a bool"),
    (Undecided, "all finite, and a bool"),
    (Lost, "all finite, and a bool, not (nan, "),
    (Vandal, "leave the costmaps as they are"),
    (Moody, "keep its state in self: Moody.moods"),
    (Gambler, "draw from context.stream(name) only"),
]


@pytest.mark.parametrize("cls, advice", BREACHES)
def test_a_breach_is_named(cls, advice):
    with pytest.raises(AssertionError) as error:
        check_local_planner(cls)
    assert advice in str(error.value)


def test_methods_must_be_there_with_their_arguments():
    class Late(DynamicWindow):
        def on_goal(self, context):
            """Nobody calls it."""

        def steer(self, context, hurry):
            return super().steer(context)

    with pytest.raises(AssertionError) as error:
        check_local_planner(Late)
    assert "take (self, context) in steer, not (self, context, hurry)" in str(error.value)
