"""Grid maps of the MovingAI benchmarks."""

import pytest

from desim.errors import InputError
from desim.imports.terrains.found import Choices
from desim.imports.terrains.read import read_terrain

MAP = "type octile\nheight 4\nwidth 6\nmap\n@@@@@@\n@..GT@\n@.SSW@\n@@@@O@\n"


def read(folder, text=MAP, **choices):
    file = folder / "a.map"
    file.write_bytes(text.encode())
    return read_terrain(file, Choices(**choices))[1]


@pytest.mark.parametrize("text", [MAP, MAP.replace("\n", "\r\n"), MAP + "\n\n",
                                  MAP.replace("octile", "tile"), MAP.partition("\n")[2]])
def test_a_map(tmp_path, text):
    """Rows are drawn from the top."""
    found = read(tmp_path, text)
    assert found.notes == ("a cell is 1 m wide (--resolution)",
                           "2 cells S (swamp, or places of tasks) are free")
    raster = found.terrain.raster
    assert ["".join(".#"[int(cell)] for cell in row) for row in raster.solid[::-1]] == [
        "#####", "#...#", "#...#", "#####"]
    assert (raster.x_m, raster.y_m, raster.resolution_m) == (0.0, 0.0, 1.0)


def test_a_width_of_cells_and_an_open_edge(tmp_path):
    found = read(tmp_path, "type octile\nheight 1\nwidth 3\nmap\n.E.\n", resolution_m=0.5)
    assert found.terrain.bounds == (-0.5, -0.5, 2.0, 1.0)
    assert found.notes == ("1 cells E (places of tasks) are free",
                           "3 free cells lie at the edge of a.map, which is closed by a wall there")


@pytest.mark.parametrize("text, complaint", [
    (MAP.replace("..G", ".G"), ":6: 5 cells; width says 6"),
    (MAP.replace("height 4", "height 5"), ": 4 rows; height says 5"),
    (MAP + "@@@@@@\n", ": 5 rows; height says 4"),
    (MAP.replace(".S", ".x"), ":7:3: 'x' is no cell of such maps; allowed: . G S (free), "
                              "@ O T W (blocked)"),
    (MAP.replace(".", "@").replace("G", "@").replace("S", "T"), ": no free cell"),
    (MAP.replace("height 4", "height 99999").replace("width 6", "width 99999"),
     ": 99999 x 99999 cells; allowed: 1 to 64000000"),
    (MAP.replace("map\n", "map of mine\n"),
     ":1: must begin with the lines type, height, width and map"),
])
def test_wrong_maps(tmp_path, text, complaint):
    with pytest.raises(InputError) as error:
        read(tmp_path, text)
    assert str(error.value) == f"{tmp_path / 'a.map'}{complaint}"
