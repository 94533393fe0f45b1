"""Which digests have changed? Writes those of tests/golden/fingerprints.csv anew.

    python tools/regolden.py [--check] [scenario ...]

A row is a scenario (a file, from the root of the repository), how long it runs, overrides that are
separated by ' ; ', the digest of its trace, and one of each layer, so that a change says what
moved: the world, the network's frames, the middleware's messages and discovery, the robots'
software, the monitor. Add a row with empty digests to have one more. A
digest that changed shows that behaviour changed, not that it became wrong: find out why, and commit
the new ones together with the change that made them. made_on.json beside it has the kind of machine
and the versions with which all of them were made: elsewhere they may differ.
"""

from __future__ import annotations

import argparse
import csv
import json
import sys
import zlib
from pathlib import Path
from typing import NamedTuple

from desim.engine.trace import together
from desim.results import identity
from desim.scenario.load import load
from desim.simulation.simulation import Simulation

ROOT = Path(__file__).resolve().parent.parent
FINGERPRINTS = ROOT / "tests" / "golden" / "fingerprints.csv"
MADE_ON = FINGERPRINTS.with_name("made_on.json")


# The layer of each kind of row; rows that a middleware writes of its own accord are its layer's.
LAYERS = {"world": ("pose", "collision", "wall"),
          "network": ("frame", "dropped", "forwarded", "background"),
          "robots": ("callback", "read", "control", "goal", "goal_reached", "goal_failed",
                     "recovery"),
          "monitor": ("sample", "sample_traffic", "sample_motion", "partition"), "middleware": ()}


class Fingerprint(NamedTuple):
    """One row: a short run, the digest of its trace, and those of its layers."""

    scenario: str
    until: str
    overrides: str
    digest: str
    world: str
    network: str
    middleware: str
    robots: str
    monitor: str

    def current(self) -> Fingerprint:
        """The same run with the digests that it has now."""
        overrides = [part for part in self.overrides.split(" ; ") if part]
        loaded = load(ROOT / self.scenario, [*overrides, f"stop.elapsed={self.until}"])
        simulation = Simulation(loaded.scenario)
        digest = simulation.run().digest
        return self._replace(digest=digest, **layers(simulation.trace.digest_by_kind()))

    def moved(self, before: Fingerprint) -> str:
        """The layers whose digests are not as they were."""
        return ", ".join(name for name in LAYERS if getattr(self, name) != getattr(before, name))


def layers(by_kind: dict[str, str]) -> dict[str, str]:
    """Layer to 12 hex digits of the digest of its kinds of rows."""
    of = {kind: layer for layer, kinds in LAYERS.items() for kind in kinds}
    return {layer: together(digest for kind, digest in by_kind.items()
                            if of.get(kind, "middleware") == layer)[:12] for layer in LAYERS}


def here() -> dict[str, str]:
    """Processor, libm and versions, on which digests may depend; zlib makes the sizes of compressed
    maps."""
    about = {**identity.machine(), **identity.versions(), "zlib": zlib.ZLIB_RUNTIME_VERSION}
    return {key: value for key, value in about.items() if key not in ("platform", "desim")}


def elsewhere() -> str:
    """The differences between this machine and that of the digests; empty if there are none."""
    made_on, now = json.loads(MADE_ON.read_text()), here()
    return ", ".join(f"{key} {now.get(key)} (there: {made_on.get(key)})"
                     for key in sorted({*made_on, *now}) if made_on.get(key) != now.get(key))


def read() -> list[Fingerprint]:
    """All rows of the file."""
    with open(FINGERPRINTS, newline="", encoding="utf-8") as file:
        return [Fingerprint(**dict.fromkeys(Fingerprint._fields, "") | row)
                for row in csv.DictReader(file)]


def write(rows: list[Fingerprint]) -> None:
    """Replace the file."""
    with open(FINGERPRINTS, "w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(Fingerprint._fields)
        writer.writerows(rows)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("scenarios", nargs="*", metavar="scenario",
                        help="rows to renew, by a part of the file's name; default: all")
    parser.add_argument("--check", action="store_true", help="write nothing; exit code 1 if a "
                                                             "digest differs")
    arguments = parser.parse_args()
    rows, changed = read(), 0
    for i, row in enumerate(rows):
        if arguments.scenarios and not any(part in row.scenario for part in arguments.scenarios):
            continue
        rows[i] = row.current()
        same = rows[i].digest == row.digest
        changed += not same
        moved = "" if same else f" (moved: {rows[i].moved(row)})"
        print(f"{'same   ' if same else 'CHANGED'} {rows[i].digest} {row.scenario} {row.until} "
              f"{row.overrides}{moved}")
    if arguments.check:
        sys.exit(changed > 0)
    if arguments.scenarios and elsewhere():
        sys.exit(f"renew all rows: this is another machine, {elsewhere()}")
    write(rows)
    MADE_ON.write_text(json.dumps(here(), indent=2) + "\n")


if __name__ == "__main__":
    main()
