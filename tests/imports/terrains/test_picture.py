"""Bare images: maps of ROS without their YAML file, and floor plans."""

import numpy as np
import pytest
from PIL import Image, ImageDraw

from desim.errors import InputError
from desim.imports.terrains.found import Choices
from desim.imports.terrains.read import read_terrain
from desim.imports.terrains.written import starts

EDGE = "{} free cells lie at the edge of {}, which is closed by a wall there"


def read(file, resolution_m=0.1, **choices):
    return read_terrain(file, Choices(resolution_m=resolution_m, **choices))[1]


def room(mode, wall, ground):
    """40 x 30 pixels, a wall of two pixels around a room of 16 x 10 with a door of four."""
    image = Image.new(mode, (40, 30), ground)
    draw = ImageDraw.Draw(image)
    draw.rectangle((10, 8, 29, 21), outline=wall, width=2)
    draw.rectangle((18, 8, 21, 9), fill=ground)
    return image


@pytest.mark.parametrize("mode, wall, ground, unclear", [
    ("L", 0, 255, ""), ("1", 0, 1, ""), ("L", 80, 230, ""),
    ("L", 100, 220, "; 9.3% of them are neither dark nor bright"),
    ("RGB", (180, 0, 0), (255, 240, 200), ""), ("RGB", (0, 0, 160), (255, 255, 255), ""),
    ("RGBA", (0, 0, 0, 255), (0, 0, 0, 0), ""), ("LA", (0, 255), (0, 0), ""),
])
def test_dark_is_wall_in_whatever_colour(tmp_path, mode, wall, ground, unclear):
    room(mode, wall, ground).save(tmp_path / "a.png")
    found = read(tmp_path / "a.png")
    assert found.notes == (f"dark pixels are walls, all others are free{unclear}",
                           EDGE.format(136, "a.png"))
    solid = found.terrain.raster.solid[1:-1, 1:-1]  # without the border
    assert solid.shape == (30, 40) and solid.sum() == 2 * 2 * 20 + 2 * 2 * 10 - 2 * 4
    assert solid[29 - 8, 10] and not solid[29 - 8, 18] and found.source is None
    assert found.terrain.bounds == pytest.approx((-0.1, -0.1, 4.1, 3.1))


def test_smooth_edges_do_not_open_a_wall(tmp_path):
    large = Image.new("L", (400, 300), 255)
    ImageDraw.Draw(large).line([(40, 30), (350, 60), (330, 270), (60, 250), (40, 30)], 0, 12)
    large.resize((100, 75), Image.Resampling.LANCZOS).save(tmp_path / "a.png")
    from scipy.ndimage import label

    assert label(~read(tmp_path / "a.png").terrain.raster.solid)[1] == 2  # inside and outside


def test_the_greys_of_map_savers_are_a_map(tmp_path):
    cells = np.full((30, 40), 205, np.uint8)
    cells[5:25, 5:35] = 254
    cells[[5, 24], 5:35] = 0
    Image.fromarray(cells).save(tmp_path / "a.pgm")
    found = read(tmp_path / "a.pgm", height_m=3.0, material="brick")
    assert found.notes == ("its greys are those of map savers: 205 is unknown ground, which is "
                           "solid",)
    assert (~found.terrain.raster.solid).sum() == 18 * 30
    assert set(found.terrain.tops_m) == {3.0}


def test_robots_start_between_walls(tmp_path):
    room("L", 0, 255).save(tmp_path / "a.png")
    assert all(1.0 < x < 2.9 and 0.9 < y < 2.1 for x, y in starts(
        read(tmp_path / "a.png").terrain))


def test_what_is_refused(tmp_path):
    file = tmp_path / "a.png"
    room("L", 0, 255).save(file)
    with pytest.raises(InputError) as error:
        read(file, None)
    assert str(error.value) == (f"{file}: an image does not say how wide its pixels are; give it "
                                "in m, as in --resolution 0.05")
    (tmp_path / "a.yaml").write_text("image: a.png\nresolution: 0.05\n")
    with pytest.raises(InputError, match="0.05; a.yaml beside it is a map of ROS, with a resol"):
        read(file, None)
    for grey, word in ((255, "bright"), (0, "dark")):
        Image.new("L", (4, 4), grey).save(file)
        with pytest.raises(InputError, match=f"a.png: all of its pixels are {word}; walls have to "
                                             "be dark on bright ground"):
            read(file)
    file.write_bytes(b"\x89PNG\r\n\x1a\nrubbish")
    with pytest.raises(InputError, match="a.png: cannot be read as an image: "):
        read(file)
    Image.new("1", (8001, 8000)).save(file)
    with pytest.raises(InputError, match="a.png: 8001 x 8000 pixels are too many"):
        read(file)


def test_bright_walls_are_a_doubt(tmp_path):
    room("L", 255, 0).save(tmp_path / "a.png")
    assert read(tmp_path / "a.png").notes[0] == (
        "most of it is dark; bright walls on dark ground have to be inverted")
