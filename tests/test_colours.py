"""The colours of pictures: one home for Python, and the page has the same."""

from __future__ import annotations

import re

from desim import colours
from desim.report.campaign.figures import style
from desim.report.replay.page import _asset
from desim.report.run_figure import _palette


def test_robots_have_the_colours_of_the_replay_page():
    light, _, _ = _asset("page/theme.css").partition(':root[data-theme="dark"]')
    assert tuple(re.findall(r"--hue-\d: (#\w{6});", light)) == colours.ROBOTS
    assert len(set(colours.ROBOTS)) == len(colours.ROBOTS)
    script = _asset("canvas/palette.js")
    assert f"const HUES = {len(colours.ROBOTS)};" in script and "hues[robot % HUES]" in script
    count = len(colours.ROBOTS)
    assert [colours.of_robot(number) for number in range(count, 2 * count)] == \
        list(map(colours.parsed, colours.ROBOTS))


def test_figures_take_theirs_from_there():
    assert style.PALETTE == colours.LINES
    for count in (1, len(colours.ROBOTS)):
        assert _palette(count)[:, :3].tolist() == [
            list(colours.of_robot(number)) for number in range(count)]


def test_a_colour_between_two():
    assert colours.parsed("#ff8000") == (1.0, 128 / 255, 0.0)
    assert colours.between((0.0, 0.5, 1.0), (1.0, 0.5, 0.0), 0.25) == (0.25, 0.5, 0.75)
