"""The picture of beliefs beside the truth."""

import pytest
from believers import Two, among
from matplotlib.colors import to_hex
from toy_middlewares import Late, Naive

from desim.errors import InputError
from desim.report.beliefs_figure import draw, drawn


def cells(figure):
    """By panel: the colour of each cell, and how many are framed."""
    def colours(axes):
        image, = axes.get_images()
        return [[to_hex(cell) for cell in row] for row in image.to_rgba(image.get_array())]
    return [(colours(axes), len(axes.patches)) for axes in figure.axes]


def test_a_partition_shows_in_the_picture():
    known = Two(Late()).at(10.0, linked=among("robot_0", "robot_2"))
    online, offline, stopped, none = "#b7dfb9", "#f6c177", "#d5d8dc", "#ffffff"
    believed, true = cells(drawn(known))
    assert believed == ([[none, online, offline],
                         [online, none, offline],
                         [stopped, stopped, none]], 2)  # 0 and 1, who are apart
    assert true == ([[none, offline, stopped],
                     [offline, none, stopped],
                     [stopped, stopped, none]], 0)


def test_the_picture(tmp_path):
    known = Two(Naive()).at(10.0)
    for name in "a.svg", "b.png":
        draw(known, tmp_path / name)
        assert (tmp_path / name).stat().st_size > 5000
    with pytest.raises(InputError, match="does not end like a picture"):
        draw(known, tmp_path / "a.txt")
