"""Changes a room's code in one place after the other, and prints which changes its tests notice.

    python tools/mutants.py ROOM [--mutants 20] [--seed 0] [--seconds 20]

ROOM is a folder or file, such as network or netmodels/switch. A *mutant* is the room with one
change: ``<`` made ``<=``, a number one greater, two arguments swapped, a statement left out. A test
that fails kills it. The tests are the room's own, then others, those nearest to the changed module
first, slow ones left out, as many as take ``--seconds`` (``tools/quick.py``). A mutant
that survives shows what no test holds, or is equivalent: it does the same. All happens in a copy of
the checkout.

The list of changes is our own, as it is short; what matters is that each module has its own tests.
Compiled code is left out: each change would be compiled anew.
"""

from __future__ import annotations

import argparse
import ast
import copy
import os
import random
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from importlib.util import cache_from_source
from pathlib import Path
from typing import Any, NamedTuple

from quick import UNKNOWN_S, distances, module_of, reach, seconds
from sources import ROOT, Source, below

PATIENCE = 5  # a mutant may take so many times as long as its tests do
START_S = 20  # and this, in which pytest starts; of a processor, for others may use it, too
WAIT = 3  # seconds of the wall clock for one of the processor
LATE = "the limit of time"
OTHER: dict[type[ast.AST], type[ast.AST]] = {
    ast.Lt: ast.LtE, ast.LtE: ast.Lt, ast.Gt: ast.GtE, ast.GtE: ast.Gt,
    ast.Eq: ast.NotEq, ast.NotEq: ast.Eq, ast.Is: ast.IsNot, ast.IsNot: ast.Is,
    ast.In: ast.NotIn, ast.NotIn: ast.In, ast.And: ast.Or, ast.Or: ast.And,
    ast.Add: ast.Sub, ast.Sub: ast.Add, ast.Mult: ast.FloorDiv, ast.FloorDiv: ast.Mult,
    ast.Div: ast.Mult, ast.Mod: ast.FloorDiv, ast.LShift: ast.RShift, ast.RShift: ast.LShift}
UNSEEN = ("annotation", "returns", "decorator_list")  # fields in which nothing is changed


class Mutant(NamedTuple):
    """One change of a file, the whole text with it, and what is different."""

    path: Path
    line: int
    change: str
    text: str


def for_typing(node: ast.AST) -> bool:
    """Whether a node is for type checkers alone."""
    return isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING"


def others(node: ast.AST) -> Iterator[ast.AST]:
    """Nodes that may take the place of a node, one for each change."""
    def altered(**fields: Any) -> ast.AST:
        new = copy.copy(node)
        for name, value in fields.items():
            setattr(new, name, value)
        return new

    match node:
        case ast.Compare(ops=[op, *rest]):
            yield altered(ops=[OTHER[type(op)](), *rest])
        case ast.BinOp(op=op) | ast.BoolOp(op=op) if type(op) in OTHER:
            yield altered(op=OTHER[type(op)]())
        case ast.UnaryOp(op=ast.Not(), operand=operand):
            yield operand
        case ast.Constant(value=bool(value)):
            yield altered(value=not value)
        case ast.Constant(value=int(value)):
            yield altered(value=value + 1)
        case ast.If(test=ast.Name() | ast.Attribute() | ast.Call() as test) if not for_typing(node):
            yield altered(test=ast.UnaryOp(ast.Not(), test))
        case ast.Call(func=func, args=[first, second, *rest]) if not isinstance(
                first, ast.Starred) and ast.unparse(func) not in ("max", "min") and (
                ast.dump(first) != ast.dump(second)):
            yield altered(args=[second, first, *rest])
        case ast.Expr(value=ast.Call()) | ast.AugAssign() | ast.Assign(
                targets=[ast.Attribute() | ast.Subscript()]):
            yield ast.Pass()


def mutants(path: Path, tree: ast.Module) -> Iterator[tuple[Any, ...]]:
    """The places of changes: the file, its tree, a list or a node, where in it, the new node."""
    agenda: list[ast.AST] = [tree]
    for node in agenda:
        if for_typing(node):
            continue
        if isinstance(node, ast.FunctionDef) and all(
                isinstance(part, ast.Expr) and isinstance(part.value, ast.Constant)
                for part in node.body):
            continue  # a contract without code: its defaults do nothing
        for field, value in ast.iter_fields(node):
            if field in UNSEEN:
                continue
            places = [(value, i, one) for i, one in enumerate(value)] if isinstance(
                value, list) else [(node, field, value)]
            for holder, where, child in places:
                if isinstance(child, ast.AST):
                    agenda.append(child)
                    yield from ((path, tree, holder, where, new) for new in others(child))


def made(path: Path, tree: ast.Module, holder: Any, where: Any, new: ast.AST) -> Mutant:
    """The mutant with ``new`` in a place of a tree, which stays as it was."""
    def put(node: ast.AST) -> None:
        if isinstance(holder, list):
            holder[where] = node
        else:
            setattr(holder, where, node)

    old = holder[where] if isinstance(holder, list) else getattr(holder, where)
    put(new)
    text = ast.unparse(tree)
    put(old)
    before, after = (ast.unparse(node).partition("\n")[0] for node in (old, new))
    return Mutant(path, old.lineno, f"{before}  ->  {after}", text)


def nearest(path: Path, limit_s: int) -> list[str]:
    """Arguments of pytest: test files that take ``limit_s`` together, without slow tests. Those in
    folders named like the module's come first, then the nearest to it by imports."""
    product, testing = below("desim", "netmodels"), below("tests", "tools")
    helpers = {source.path.stem: source for source in testing.values()}
    near = distances(product, {Source.of(str(path), "").module})
    folders = {*path.parts[1:-1], *["network_models"] * (path.parts[0] == "netmodels")}
    times, found = seconds(), []
    for test in testing.values():
        if test.path.name.startswith("test_"):
            ways = [near[module] for name in reach(test, helpers)[0]
                    if (module := module_of(name, product)) in near]
            if ways:
                found.append((-len(folders.intersection(test.path.parts)), min(ways),
                              times.get(str(test.path), UNKNOWN_S), str(test.path)))
    spent_s, files = 0.0, []
    for *_, time_s, name in sorted(found):
        if spent_s + time_s <= limit_s:
            spent_s += time_s
            files.append(name)
    return files + [f"--deselect={name}" for name in times if name.partition("::")[0] in files
                    and "::" in name]


def verdict(folder: Path, tests: list[str], limit_s: int) -> str:
    """The first test that fails in a checkout, or that they take too long; nothing if they pass."""
    def limit() -> None:
        resource.setrlimit(resource.RLIMIT_CPU, (limit_s, limit_s))

    with tempfile.TemporaryFile("w+") as output:
        pytest = subprocess.Popen(
            [sys.executable, "-m", "pytest", "-x", "-q", "-p", "no:cacheprovider", "--no-header",
             "--tb=no", "-rfE", "-m", "not validation", *tests], cwd=folder, stdout=output,
            stderr=subprocess.DEVNULL, preexec_fn=limit, start_new_session=True,
            env={**os.environ, "PYTHONPATH": str(folder)})
        try:
            status = pytest.wait(WAIT * limit_s)
        except subprocess.TimeoutExpired:  # it sleeps, or waits for what never comes
            os.killpg(pytest.pid, signal.SIGKILL)
            status = pytest.wait()
        if status <= 0:
            return LATE if status else ""
        output.seek(0)
        failed = [line.strip().partition(" ")[2].partition(" - ")[0] for line in output
                  if line.startswith(("FAILED", "ERROR"))]
    return failed[0] if failed else tests[0]  # nothing can be imported


def killer(folder: Path, mutant: Mutant, tests: list[str], limit_s: int, unfit: list[str]) -> str:
    """The first test of ``tests`` that fails in a checkout with a mutant; nothing if it survives.
    What fails without it, too, in the same company, is added to ``unfit``: tests and files that are
    not run."""
    file = folder / mutant.path
    original = file.read_bytes()
    while tests := [name for name in tests if name not in unfit]:
        left_out = [f"--deselect={name}" for name in unfit]
        replace(file, mutant.text.encode())
        by = verdict(folder, tests + left_out, limit_s)
        replace(file, original)
        if by in ("", LATE):
            return by
        until = tests.index(by.partition("::")[0]) + 1
        wrong = verdict(folder, [*tests[:until], *(name for name in tests[until:] if "::" in name),
                                 *left_out], limit_s)
        if not wrong:
            return by
        unfit.append(by if wrong == LATE else wrong)
    return ""


def replace(file: Path, text: bytes) -> None:
    """Write a module anew. Bytecode counts as that of any text of the same size and second."""
    file.write_bytes(text)
    Path(cache_from_source(str(file))).unlink(missing_ok=True)


def copied(folder: Path) -> None:
    """Copy the files of the checkout, as they are now, but for what git ignores."""
    names = subprocess.run(["git", "ls-files", "-z", "-co", "--exclude-standard"], cwd=ROOT,
                           check=True, capture_output=True, text=True).stdout
    for name in filter(None, names.split("\0")):
        if (ROOT / name).is_file():
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(ROOT / name, folder / name)


def room_of(name: str) -> list[Path]:
    """The files of a room, without those with compiled code."""
    place = next((place for place in (ROOT / "desim" / name, ROOT / name) if place.exists()), None)
    if place is None:
        raise SystemExit(f"mutants: there is no {name} and no desim/{name}")
    files = sorted(place.rglob("*.py")) if place.is_dir() else [place]
    return [path.relative_to(ROOT) for path in files
            if "numba" not in path.read_text() and "kernels" not in path.parts]


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("room", help="a folder or a file")
    parser.add_argument("--mutants", type=int, default=20, help="how many, drawn at random")
    parser.add_argument("--seed", type=int, default=0, help="of the draw")
    parser.add_argument("--seconds", type=int, default=20, help="the time of a mutant's tests")
    given = parser.parse_args()
    places = [place for path in room_of(given.room)
              for place in mutants(path, ast.parse((ROOT / path).read_text()))]
    drawn = random.Random(given.seed).sample(places, min(given.mutants, len(places)))
    killed = total = 0
    unfit: list[str] = []
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        copied(folder)
        for mutant in sorted((made(*place) for place in drawn), key=lambda one: one[:2]):
            tests, limit_s = nearest(mutant.path, given.seconds), START_S + PATIENCE * given.seconds
            by = killer(folder, mutant, tests, limit_s, unfit)
            total += 1
            killed += bool(by)
            print(f"{mutant.path}:{mutant.line}\t{mutant.change}\t"
                  f"{'killed by ' + by if by else 'SURVIVED'}", flush=True)
    print(f"{given.room}: {total} mutants, {killed} killed, {total - killed} survived")
    return 0


if __name__ == "__main__":
    sys.exit(main())
