"""Checks of what map sharing publishes and takes in: one line says who was wrong, and how."""

import re

import pytest
import wrong_sharing
from runs import HELLO, built

from desim.blame import blame
from desim.errors import ModelError
from desim.testing import check_sharing

RADIO = ("deployment=field", "network.media.air={model: radio}")


@pytest.mark.parametrize(("name", "says"), [
    ("Text", "a content has size_bytes, an int >= 0; 'hello' has none"),
    ("Negative", "size_bytes of a content is an int >= 0, not -4"),
    ("Fraction", r"size_bytes of a content is an int >= 0, not 4\.5"),
    ("Unadvertised", "topic 'more' is published but not advertised; advertised: ''"),
    ("Numbers", "a robot takes in Contributions, not 1"),
    ("Nothing", "a robot takes in a list of Contributions, not None"),
    ("Ghost", "a Contribution comes from a robot that maps are shared with, not from 'ghost'"),
    ("Own", r"a Contribution comes from a robot that maps are shared with, not from 'robot_\d' "
            r"\(did you mean 'robot_\d'\?\)"),
    ("ToCome", r"the version 10{18} is to come: the clock of robot_\d shows \d+ ns; wanted: what "
               "it showed when pose and evidence were taken"),
    ("Late", r"a Contribution's version is an int, the clock of robot_\d in ns, not 0\.5"),
    ("Lost", r"a Contribution's pose is a Pose2D of three finite numbers, or None, not "
             r"Pose2D\(x_m=nan, y_m=0\.0, yaw_rad=0\.0\)"),
    ("Flat", r"evidence is int8 \[\d+, \d+\], not list"),
    ("Framed", r"a frame lies at a Pose2D of three finite numbers, or None, not "
               r"\(1\.0, 2\.0, 3\.0\)"),
])
def test_the_plug_in_is_named_with_its_line_robot_and_time(name, says):
    with pytest.raises(ModelError) as caught:
        built(HELLO, *RADIO, f"coordination.exchange={{model: 'wrong_sharing:{name}'}}").run()
    assert re.fullmatch(rf"sharing wrong_sharing:{name} raised ModelError: {says} at "
                        r"wrong_sharing\.py:\d+ \(robot_\d, 0\.\d+ s\)", blame(caught.value).line)


@pytest.mark.parametrize(("name", "says"), [
    ("Text", "a content has size_bytes, an int >= 0; 'hello' has none$"),
    ("Negative", "size_bytes of a content is an int >= 0, not -4$"),
    ("Ghost", "maps are shared with, not from 'ghost'$"), ("Own", "not from 'robot_1' "),
    ("Numbers", "Contributions, not 1$"), ("Lost", "a Contribution's pose is a Pose2D "),
    ("Flat", r"evidence is int8 \[128, 128\], not list$"), ("Framed", "a frame lies at a Pose2D"),
])
def test_the_kit_says_the_same(name, says):
    with pytest.raises(ModelError, match=says):
        check_sharing(getattr(wrong_sharing, name))
