"""The vectors of findings.yaml and findings_small.yaml.

They are fleets of all sizes in two terrains and, as in the paper's comparison of terrains, of eight
robots in the other two.
"""

SIZES = [1, 2, 4, 8, 11, 16, 30]


def vectors(sizes=SIZES):
    cases = [(size, terrain) for size in sizes for terrain in ("maze", "zigzag")]
    cases += [(8, "loop"), (8, "cross")]
    return [{"robots": size, "terrain": terrain, "own_map": own_map}
            for size, terrain in cases for own_map in ("merged", "at_once")]


def small():
    return vectors(SIZES[:-1])
