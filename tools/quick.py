"""Runs the tests that are nearest to a change, as many as fit into a minute.

    python tools/quick.py [--base REV] [--list]
    python tools/quick.py --times REPORT.xml     (of pytest --junitxml; writes tests/seconds.txt)

A change is what differs from REV (by default from the last commit; from the one before it where
nothing differs). A changed module's room is its package. Imports say how far a test file is from
that room: 0, it or one of its helpers changed; 1, it imports from the room; 2, it imports a module
that does; and so on. The nearest files run first, of equally near ones the fastest.
``tests/seconds.txt`` has the time of each file, and of slow tests, which never run here.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
from collections import defaultdict
from collections.abc import Iterable
from pathlib import Path, PurePosixPath
from xml.etree import ElementTree

from sources import ROOT, Source, below

SECONDS = ROOT / "tests" / "seconds.txt"
HEADER = """\
# Seconds of one core for each test file without its slow tests, and for each slow test.
# python tools/quick.py --times REPORT.xml writes this file.
"""
LIMIT_S = 55.0  # the sum of the chosen files: on two cores half of it passes, and pytest starts
SLOW_S = 2.0  # a test that takes longer is slow
UNKNOWN_S = 1.0  # the time of a file that is not in seconds.txt
SAME_LAYER = 3.0  # the distance of tests in a changed layer's folder that import nothing of it


def changed_files(base: str | None) -> list[str]:
    """Paths that differ from ``base``, new ones included."""
    def git(*words: str) -> list[str]:
        return subprocess.run(["git", *words], cwd=ROOT, check=True, text=True,
                              capture_output=True).stdout.splitlines()

    found = git("diff", "--name-only", base or "HEAD")
    found += git("ls-files", "--others", "--exclude-standard")
    return found or git("diff", "--name-only", "HEAD~1")


def room(module: str, product: dict[str, Source]) -> str:
    """The package of a module."""
    if module in product and product[module].path.name == "__init__.py":
        return module
    return module.rpartition(".")[0]


def distances(product: dict[str, Source], start: set[str]) -> dict[str, int]:
    """The number of imports from each module to the nearest module of ``start``."""
    importers: dict[str, set[str]] = defaultdict(set)
    for source in product.values():
        for _, name in source.imports():
            importers[module_of(name, product)].add(source.module)
    found = dict.fromkeys(sorted(start), 0)
    agenda = list(found)
    for module in agenda:
        for importer in sorted(importers[module]):
            if importer not in found:
                found[importer] = found[module] + 1
                agenda.append(importer)
    return found


def module_of(name: str, product: dict[str, Source]) -> str:
    """The module that an imported name is, or is in."""
    return name if name in product else name.rpartition(".")[0]


def reach(test: Source, helpers: dict[str, Source]) -> tuple[set[str], set[str]]:
    """The names that a test imports, itself and by its helpers, and the paths of these."""
    names: set[str] = set()
    agenda = [test]
    for source in agenda:
        for _, name in source.imports():
            names.add(name)
            helper = helpers.get(name.partition(".")[0])
            if helper is not None and helper not in agenda:
                agenda.append(helper)
    return names, {str(source.path) for source in agenda}


def ranked(changed: Iterable[str]) -> list[tuple[float, str]]:
    """Distance and path of each test file that can see a change, the nearest first."""
    product = below("desim", "netmodels")
    testing = below("tests", "tools")
    helpers = {source.path.stem: source for source in testing.values()}
    modules = [".".join(PurePosixPath(path).with_suffix("").parts).removesuffix(".__init__")
               for path in changed if path.startswith(("desim/", "netmodels/"))
               and path.endswith(".py")]
    rooms = {room(module, product) for module in modules}
    near = distances(product, {module for module in product if room(module, product) in rooms})
    layers = {module.split(".")[1 if module.startswith("desim.") else 0] for module in modules}
    others = [PurePosixPath(path).name for path in changed if not path.endswith(".py")]
    found = []
    for test in testing.values():
        if not test.path.name.startswith("test_"):
            continue
        names, paths = reach(test, helpers)
        ways = [1.0 + near[module] for name in names
                if (module := module_of(name, product)) in near]
        ways += [0.0] * bool(paths & set(changed))
        ways += [1.0] * any(name in test.text for name in others)
        ways += [SAME_LAYER] * bool(layers & set(test.path.parts))
        if ways:
            found.append((min(ways), str(test.path)))
    return found


def seconds() -> dict[str, float]:
    """The time of each test file by its path, and of each slow test by its id."""
    lines = (line.rsplit(maxsplit=1) for line in SECONDS.read_text().splitlines()
             if not line.startswith("#"))
    return {path: float(value) for path, value in lines}


def chosen(found: Iterable[tuple[float, str]], times: dict[str, float]) -> list[str]:
    """The nearest files, and of equally near ones the fastest, whose sum is at most ``LIMIT_S``."""
    spent_s, taken = 0.0, []
    for _, time_s, path in sorted((distance, times.get(path, UNKNOWN_S), path)
                                  for distance, path in found):
        if spent_s + time_s <= LIMIT_S:
            taken.append(path)
            spent_s += time_s
    return taken


def measured(report: Path) -> dict[str, float]:
    """The time of each file, and of each slow test, in pytest's report in JUnit's format."""
    times: dict[str, float] = defaultdict(float)
    for case in ElementTree.parse(report).iter("testcase"):
        parts, time_s = case.attrib["classname"].split("."), float(case.attrib["time"])
        inside = next(n for n in range(len(parts), 0, -1)
                      if (ROOT / Path(*parts[:n])).with_suffix(".py").is_file())
        path = str(PurePosixPath(*parts[:inside]).with_suffix(".py"))
        if time_s > SLOW_S:
            times["::".join([path, *parts[inside:], case.attrib["name"]])] = time_s
            times[path] += 0.0
        else:
            times[path] += time_s
    return dict(times)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--base", help="what the change is measured from: a commit")
    parser.add_argument("--list", action="store_true", help="only print the files")
    parser.add_argument("--times", type=Path, metavar="REPORT.xml", help="write tests/seconds.txt")
    given = parser.parse_args()
    if given.times:
        SECONDS.write_text(HEADER + "".join(
            f"{path} {time_s:.1f}\n" for path, time_s in sorted(measured(given.times).items())))
        return 0
    changed, times = changed_files(given.base), seconds()
    found = ranked(changed)
    files = chosen(found, times)
    print(f"{len(changed)} changed files; {len(files)} of the {len(found)} test files that can see "
          f"them, the nearest first", flush=True)
    if given.list or not files:
        print(*files, sep="\n")
        return 0
    slow = [f"--deselect={test}" for test in times if test.partition("::")[0] in files
            and "::" in test]
    return subprocess.run([sys.executable, "-m", "pytest", "-n", "2", "--dist", "worksteal", "-m",
                           "not validation", *slow, *files], cwd=ROOT).returncode


if __name__ == "__main__":
    sys.exit(main())
