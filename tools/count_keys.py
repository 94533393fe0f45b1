"""How many keys do scenarios and plug-ins have?

    python tools/count_keys.py [--list]

Prints a row for the scenario and for each kind of plug-in. A key is a parameter that has a value,
not a block of others. ``keys`` counts it once, wherever its block stands: ``robot.laser.rate`` and
``fleet.types.NAME.robot.laser.rate`` are one, and so is ``hosts`` of all rules. ``paths`` counts
each place in a scenario, and in the parameters of each plug-in. ``constants`` are one key, however
many names they have (``desim.ports.Constants``); ``names`` counts these. ``--list`` prints every
path. ``tests/test_count_keys.py`` holds the sums.
"""

from __future__ import annotations

import argparse
import inspect
from collections.abc import Iterator, Sequence
from typing import NamedTuple

from site_pages.keys import blocks_in

from desim import plugins
from desim.ports import Constants, Params
from desim.scenario.schema.scenario import Scenario


class Key(NamedTuple):
    """A value at ``path`` of a part, the class and field that define it, and the number of names
    of constants that it may change."""

    part: str
    path: str
    definition: str
    names: int


class Sum(NamedTuple):
    """The numbers of a part."""

    keys: int
    paths: int
    names: int


def keys() -> list[Key]:
    """All keys of scenarios and of installed plug-ins."""
    found = list(_of("scenario", "", Scenario))
    for kind in plugins.GROUPS:
        for name in plugins.available(kind):
            if plugins.block_of(plugins.load(kind, name)):
                found += _of(kind, f"{name}: ", plugins.parameters(kind, name))
    return found


def _of(part: str, path: str, block: type[Params]) -> Iterator[Key]:
    for name, info in block.model_fields.items():
        key = f"{path}{info.alias or name}"
        inside = list(blocks_in(key, info.annotation))
        if not inside:
            kind = info.annotation
            constants = inspect.isclass(kind) and issubclass(kind, Constants)
            yield Key(part, key, f"{_owner(block, name)}.{name}",
                      len(kind.model_fields) if constants else 0)
        for below, inner in inside:
            yield from _of(part, f"{below}.", inner)


def _owner(block: type[Params], field: str) -> str:
    """The class that defines a field first."""
    return next(f"{cls.__module__}.{cls.__qualname__}" for cls in reversed(block.__mro__)
                if field in cls.__dict__.get("__annotations__", {}))


def sums(found: Sequence[Key]) -> dict[str, Sum]:
    """Part to its numbers, in order; ``all`` at the end. A key counts in the first part."""
    first = {key.definition: key for key in reversed(found)}.values()
    places = {(key.part, key.path) for key in found}
    parts = list(dict.fromkeys(key.part for key in found))
    return {
        part: Sum(sum(part in (key.part, "all") for key in first),
                  sum(part in (own, "all") for own, _ in places),
                  sum(key.names for key in first if part in (key.part, "all")))
        for part in (*parts, "all")}


def main() -> None:
    """The command."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--list", action="store_true", help="every path")
    found = keys()
    if parser.parse_args().list:
        print("\n".join(dict.fromkeys(f"{key.part} {key.path}" for key in found)))
        return
    print(f"{'':14}" + "".join(f"{field:>7}" for field in Sum._fields))
    for part, numbers in sums(found).items():
        print(f"{part:14}" + "".join(f"{number:7}" for number in numbers))


if __name__ == "__main__":
    main()
