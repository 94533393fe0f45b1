"""The number of keys is bounded; ``tools/count_keys.py`` counts them."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from typing import Annotated

from count_keys import Key, _of, sums  # a tool

from desim.ports import Constants, Params

TOOL = Path(__file__).resolve().parents[1] / "tools" / "count_keys.py"
MOST_KEYS, MOST_PATHS = 658, 1187


def test_keys_stay_few():
    """In a process of its own: other tests install plug-ins, which count in theirs."""
    done = subprocess.run([sys.executable, TOOL], capture_output=True, text=True, check=True)
    name, keys, paths, _ = done.stdout.splitlines()[-1].split()
    assert name == "all"
    assert int(keys) <= MOST_KEYS
    assert int(paths) <= MOST_PATHS


def test_a_block_at_two_places_counts_once_but_for_its_paths():
    found = [Key("scenario", "robot.laser.rate", "Laser.rate_hz", 0),
             Key("scenario", "fleet.types.NAME.robot.laser.rate", "Laser.rate_hz", 0),
             Key("scenario", "fleet.types.NAME.robot.laser.rate", "Laser.rate_hz", 0),
             Key("middleware", "ros1: constants", "RosParams.constants", 10),
             Key("middleware", "multimaster: constants", "RosParams.constants", 10)]
    assert sums(found) == {"scenario": (1, 2, 0), "middleware": (1, 2, 10), "all": (2, 4, 10)}


def test_names_of_constants_are_no_keys():
    class Wire(Constants):
        """Two constants."""

        preamble: int = 8
        gap: int = 12

    class Block(Params):
        """A key and constants, alone or in a list."""

        rate: Annotated[int, "b/s"] = 1
        constants: Wire = Wire()

    class Whole(Params):
        """Two keys."""

        each: tuple[Block, ...] = ()

    assert [(key.path, key.names) for key in _of("x", "", Whole)] == [
        ("each.N.rate", 0), ("each.N.constants", 2)]
