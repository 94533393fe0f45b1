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
])
def test_the_plug_in_is_named_with_its_line_robot_and_time(name, says):
    with pytest.raises(ModelError) as caught:
        built(HELLO, *RADIO, f"coordination.exchange={{model: 'wrong_sharing:{name}'}}").run()
    assert re.fullmatch(rf"sharing wrong_sharing:{name} raised ModelError: {says} at "
                        r"wrong_sharing\.py:\d+ \(robot_\d, 0\.\d+ s\)", blame(caught.value).line)


@pytest.mark.parametrize("name", ["Text", "Negative", "Fraction"])
def test_the_kit_says_the_same(name):
    with pytest.raises(ModelError, match="size_bytes"):
        check_sharing(getattr(wrong_sharing, name))
