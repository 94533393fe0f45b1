"""Maps of strangers: images of named formats, in the map's folder, of a bounded size."""

import os
import struct
import zlib

import numpy as np
import pytest
from PIL import Image

from desim.errors import InputError
from desim.scenario.schema.environment import MapFile
from desim.world import map_files, map_images, terrain

MAP = ("image: {image}\nresolution: 0.1\norigin: [0, 0, 0]\nnegate: 0\noccupied_thresh: 0.65\n"
       "free_thresh: 0.196\n")


def loaded(folder, image, text=MAP):
    (folder / "map.yaml").write_text(text.format(image=image))
    return map_files.load(MapFile(map=str(folder / "map.yaml")), 0)


def png(width, height):
    """A PNG that says it has these many pixels, and has none."""
    def part(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(
            ">I", zlib.crc32(kind + data))
    return (b"\x89PNG\r\n\x1a\n" + part(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 0, 0, 0,
                                                           0))
            + part(b"IDAT", zlib.compress(b"")) + part(b"IEND", b""))


@pytest.mark.parametrize("width, height", [(60_000, 60_000), (9000, 9000)])
def test_an_image_of_too_many_pixels_is_refused_before_it_is_read(tmp_path, width, height):
    (tmp_path / "map.png").write_bytes(png(width, height))
    with pytest.raises(InputError, match="map.png: (.* too many|cannot be read as an image: Image "
                                         "size .* decompression bomb)"):
        loaded(tmp_path, "map.png")


@pytest.mark.parametrize("begins", [b"%!PS-Adobe-3.0 EPSF-3.0\n%%BoundingBox: 0 0 9 9\n",
                                    b"GIF89a", b"8BPS\0\1", b"\x89HDF\r\n\x1a\n"])
def test_an_image_of_another_format_is_not_opened(tmp_path, begins):
    (tmp_path / "map.pgm").write_bytes(begins + bytes(1000))
    with pytest.raises(InputError, match="map.pgm: cannot be read as an image: cannot identify"):
        loaded(tmp_path, "map.pgm")


def test_a_map_names_an_image_in_its_folder_or_the_one_above_and_a_scenario_any(tmp_path):
    folder, other = tmp_path / "maps", tmp_path / "other.pgm"
    (folder / "below").mkdir(parents=True)
    for path in (other, folder / "below" / "in.pgm"):
        Image.fromarray(np.full((4, 4), 254, np.uint8)).save(path)
    (folder / "link.pgm").symlink_to(other)
    os.mkfifo(folder / "pipe.pgm")
    assert loaded(folder, "./below/in.pgm") and loaded(folder, "below/../below/in.pgm")
    named = "/home/somebody/maps/below/in.pgm"  # as the machine that saved the map had it
    assert loaded(folder, named).doubts[0] == (
        f"{folder / 'map.yaml'}: its image {named} is taken from its own folder")
    assert loaded(folder, "../other.pgm")
    for name, why in (("../../other.pgm", "is no name of a file in a folder"),
                      ("../maps/link.pgm", "is a symbolic link, which desim does not follow"),
                      (str(tmp_path.parent / "none.pgm"), "is no name of a file in a folder"),
                      ("/dev/zero", "is no name of a file in a folder"),
                      ("link.pgm", "is a symbolic link, which desim does not follow"),
                      ("pipe.pgm", "no regular file")):
        with pytest.raises(InputError, match=f"cannot be read as an image: .*{why}"):
            loaded(folder, name)
    assert map_files.load(MapFile(map=str(folder / "map.yaml"), image="../other.pgm"), 0)


@pytest.mark.parametrize("resolution", ["[" * 500, "&a [*a]", "1" + ":59" * 100_000])
def test_yaml_that_would_take_long_is_refused(tmp_path, resolution):
    with pytest.raises(InputError, match="map.yaml"):
        loaded(tmp_path, "map.pgm", MAP.replace("0.1", resolution, 1))


@pytest.mark.parametrize("mode", ["L", "RGB", "I;16", "1", "LA"])
def test_greys_of_all_kinds_of_images_are_means_of_their_channels(tmp_path, mode):
    grey = np.array([[0, 100, 205, 254]], np.uint8)
    made = (Image.fromarray(grey.astype(np.uint16) * 257) if mode == "I;16" else
            Image.fromarray(grey).convert(mode))
    made.save(tmp_path / "map.png")
    with ((tmp_path / "map.png").open("rb") as file,
          map_images.opened(tmp_path / "map.png", file) as image):
        found = map_images.greys(tmp_path / "map.png", image)
    want = np.asarray(made.convert("RGB"), float).mean(axis=2) if mode != "I;16" else grey
    assert np.array_equal(found.values[found.cells], want)


def test_noise_is_refused_before_its_walls_are_made(tmp_path):
    """725 x 725 posts in a room have four walls each."""
    pixels = np.full((1451, 1451), 254, np.uint8)
    pixels[1::2, 1::2] = 0
    Image.fromarray(pixels).save(tmp_path / "map.pgm")
    with pytest.raises(InputError) as caught:
        loaded(tmp_path, "map.pgm")
    assert str(caught.value) == (f"{tmp_path / 'map.yaml'}: 2102504 straight walls are too many "
                                 "(allowed: 2000000); is it noise?")


@pytest.mark.parametrize("most", [7, 8])
def test_as_many_walls_as_are_allowed(tmp_path, monkeypatch, most):
    monkeypatch.setattr(terrain, "MOST_WALLS", most)
    pixels = np.full((5, 5), 254, np.uint8)
    pixels[2, 2] = 0  # a post in a room: four walls each
    Image.fromarray(pixels).save(tmp_path / "map.pgm")
    if most == 8:
        assert len(loaded(tmp_path, "map.pgm").walls) == 8
    else:
        with pytest.raises(InputError, match="8 straight walls are too many"):
            loaded(tmp_path, "map.pgm")
