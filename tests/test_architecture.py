"""The rules of the design, as far as a test can see them. Each complaint is a file and a line."""

from __future__ import annotations

import ast
import subprocess
import sys
from collections.abc import Callable, Iterable, Iterator
from functools import cache
from pathlib import Path, PurePosixPath
from typing import NamedTuple

import pytest
from rooms import STORY

ROOT = Path(__file__).resolve().parent.parent
MAX_LINES = 400

# Files that may read the wall clock: they report on a run or its cost, and never change it.
WALL_CLOCK = {"desim/campaign/running/probes.py", "desim/campaign/running/crew.py",
              "desim/campaign/running/driver.py",
              "desim/commands/compiling.py", "desim/api.py", "desim/results/folder.py",
              "desim/commands/views/progress.py", "desim/commands/views/sweep.py"}
# Who may name the global generators: the makers of streams, and the check that a plug-in draws
# nothing from them.
GLOBAL_GENERATORS = {"desim/engine/streams.py", "desim/testing/checks.py"}
TRANSCENDENTAL = {"sin", "cos", "tan", "asin", "acos", "atan", "atan2", "arcsin", "arccos",
                  "arctan", "arctan2", "sinh", "cosh", "tanh", "exp", "exp2", "expm1", "log",
                  "log2", "log10", "log1p", "pow", "power", "hypot"}

Complaints = Iterator[tuple[int, str]]


class Source(NamedTuple):
    """One file: its path from the root, its text, its syntax tree."""

    path: PurePosixPath
    text: str
    tree: ast.Module

    @classmethod
    def of(cls, path: str, text: str) -> Source:
        return cls(PurePosixPath(path), text, ast.parse(text))

    @property
    def module(self) -> str:
        parts = self.path.with_suffix("").parts
        return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)

    def imports(self) -> Iterator[tuple[int, str]]:
        """Line and full name of every imported module, ``from a import b`` as ``a.b``."""
        package = self.module.split(".")
        if self.path.name != "__init__.py":
            package = package[:-1]
        for node in ast.walk(self.tree):
            if isinstance(node, ast.Import):
                yield from ((node.lineno, alias.name) for alias in node.names)
            elif isinstance(node, ast.ImportFrom):
                base = package[:len(package) + 1 - node.level] if node.level else []
                stem = ".".join([*base, *filter(None, [node.module])])
                yield from ((node.lineno, f"{stem}.{alias.name}") for alias in node.names)

    def calls(self) -> Iterator[tuple[int, str, ast.Call]]:
        """Line, dotted name and node of every call whose function has a dotted name."""
        for node in ast.walk(self.tree):
            if isinstance(node, ast.Call) and (name := dotted(node.func)):
                yield node.lineno, name, node


def dotted(node: ast.expr) -> str:
    """``a.b.c`` of an attribute chain, or nothing."""
    if isinstance(node, ast.Name):
        return node.id
    if isinstance(node, ast.Attribute) and (stem := dotted(node.value)):
        return f"{stem}.{node.attr}"
    return ""


def inside(name: str, *packages: str) -> bool:
    return any(name == package or name.startswith(package + ".") for package in packages)


@cache
def sources() -> dict[str, Source]:
    """Module name to source, of both packages."""
    paths = sorted(path for package in ("desim", "netmodels")
                   for path in (ROOT / package).rglob("*.py"))
    all_of = [Source.of(str(path.relative_to(ROOT)), path.read_text()) for path in paths]
    return {source.module: source for source in all_of}


# ------------------------------------------------------------------------------------- the rules


def desim_never_imports_netmodels(source: Source) -> Complaints:
    if inside(source.module, "desim"):
        for line, name in source.imports():
            if inside(name, "netmodels"):
                yield line, f"imports {name}; plug-ins are found by entry point"


def netmodels_sees_of_desim_only_the_contracts(source: Source) -> Complaints:
    if inside(source.module, "netmodels"):
        for line, name in source.imports():
            if inside(name, "desim") and not inside(
                    name, "desim.units", "desim.errors", "desim.ports"):
                yield line, f"imports {name}; allowed: desim.units, desim.errors, desim.ports"


def robots_never_import_the_world(source: Source) -> Complaints:
    if inside(source.module, "desim.robot"):
        for line, name in source.imports():
            way = way_to_the_world(name)
            if way:
                yield line, f"reaches the world: {' -> '.join(way)}"


def way_to_the_world(name: str) -> list[str]:
    """The chain of imports from ``name`` (a module or a name in one) into desim.world, if any."""
    seen: dict[str, list[str]] = {}
    agenda = [(name, [name])]
    while agenda:
        current, way = agenda.pop()
        if inside(current, "desim.world"):
            return way
        module = current if current in sources() else current.rpartition(".")[0]
        if module in sources() and module not in seen:
            seen[module] = way
            agenda += [(following, [*way, following])
                       for _, following in sources()[module].imports()]
    return []


# The rooms of the campaign, from the ground up.
CAMPAIGN = ["design", "folder", "running", "deploy"]


def rooms_import_downwards(source: Source) -> Complaints:
    parts = source.module.split(".")
    for line, name in source.imports():
        found = name.split(".")
        if parts[0] != "desim" or found[0] != "desim" or len(parts) == 1 or len(found) == 1:
            continue
        if len(found) == 2 and f"desim.{found[1]}" not in sources():
            continue  # a name of desim/__init__.py
        if STORY.index(found[1]) > STORY.index(parts[1]):
            yield line, f"imports {name}; {parts[1]} stands below {found[1]}"
        both = parts[1] == found[1] == "campaign" and len(parts) > 2 and len(found) > 2
        if both and CAMPAIGN.index(found[2]) > CAMPAIGN.index(parts[2]):
            yield line, f"imports {name}; {parts[2]} stands below {found[2]}"


def simpy_is_behind_the_kernel(source: Source) -> Complaints:
    if str(source.path) != "desim/engine/kernel.py":
        for line, name in source.imports():
            if inside(name, "simpy"):
                yield line, "imports simpy; only desim/engine/kernel.py may"


def numba_is_in_kernels_files(source: Source) -> Complaints:
    if not is_kernels(source) and str(source.path) != "desim/engine/compiled.py":
        for line, name in source.imports():
            if inside(name, "numba"):
                yield line, "imports numba; only kernels.py and files in kernels/ may"


def is_kernels(source: Source) -> bool:
    """Whether a file is called ``kernels.py``, or is in a package ``kernels``."""
    return source.path.name == "kernels.py" or source.path.parent.name == "kernels"


def kernels_are_compiled_at_import_cached_and_exact(source: Source) -> Complaints:
    for node in ast.walk(source.tree):
        if not isinstance(node, ast.FunctionDef):
            continue
        for decorator in node.decorator_list:
            call = decorator if isinstance(decorator, ast.Call) else None
            if dotted(call.func if call else decorator).split(".")[-1] not in ("njit", "jit"):
                continue
            options = {word.arg: ast.unparse(word.value) for word in call.keywords} if call else {}
            if not call or not call.args or options.get("cache") != "True":
                yield node.lineno, f"{node.name}: a signature and cache=True are missing"
            for option in ("fastmath", "parallel"):
                if options.get(option, "False") != "False":
                    yield node.lineno, f"{node.name}: {option} reorders floating point"


def kernels_take_transcendentals_from_one_module(source: Source) -> Complaints:
    if not is_kernels(source) or str(source.path) == "desim/ports/kernels.py":
        return
    for line, name in source.imports():
        if name.rpartition(".")[0] in ("math", "numpy") and name.split(".")[-1] in TRANSCENDENTAL:
            yield line, f"imports {name}; take it from desim/ports/kernels.py"
    for line, name, _ in source.calls():
        stem, _, function = name.rpartition(".")
        if stem in ("math", "np", "numpy") and function in TRANSCENDENTAL:
            yield line, f"calls {name}; take it from desim/ports/kernels.py"


def only_the_surface_prints(source: Source) -> Complaints:
    if inside(source.module, "desim.commands", "desim.report"):
        return
    for line, name in source.imports():
        if inside(name, "rich"):
            yield line, "imports rich; only commands/ and report/ may"
    for line, name, _ in source.calls():
        if name in ("print", "sys.stdout.write", "sys.stderr.write"):
            yield line, f"calls {name}; only commands/ and report/ may"


def random_numbers_come_by_name(source: Source) -> Complaints:
    if str(source.path) in GLOBAL_GENERATORS:
        return
    for line, name in source.imports():
        if inside(name, "random", "secrets", "uuid", "numpy.random"):
            yield line, f"imports {name}; ask for a stream by name"
    for line, name, _ in source.calls():
        if name.startswith(("np.random.", "numpy.random.", "os.urandom")):
            yield line, f"calls {name}; ask for a stream by name"


def only_reports_read_the_wall_clock(source: Source) -> Complaints:
    if str(source.path) not in WALL_CLOCK:
        for line, name in source.imports():
            if inside(name, "time", "datetime"):
                yield line, f"imports {name}; time is kernel.now_ns"


def nothing_depends_on_the_process(source: Source) -> Complaints:
    for line, name, _ in source.calls():
        if name in ("hash", "eval", "exec"):
            yield line, f"calls {name}()"


def sets_are_never_iterated(source: Source) -> Complaints:
    known = {name for name, value in assignments(source.tree) if is_set(value, set())}
    for node in ast.walk(source.tree):
        over = []
        if isinstance(node, ast.For | ast.comprehension):
            over = [node.iter]
        elif isinstance(node, ast.Starred):
            over = [node.value]
        elif isinstance(node, ast.Call) and dotted(node.func).split(".")[-1] in (
                "list", "tuple", "enumerate", "zip", "map", "iter", "join", "fromiter", "array"):
            over = node.args
        for value in over:
            if is_set(value, known):
                yield value.lineno, f"iterates over the set {ast.unparse(value)}; sort it"


def assignments(tree: ast.Module) -> Iterator[tuple[str, ast.expr]]:
    """Dotted name and value, or annotation, of every simple assignment."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Assign):
            for target in node.targets:
                yield dotted(target), node.value
        elif isinstance(node, ast.AnnAssign):
            yield dotted(node.target), node.annotation


def is_set(node: ast.expr, known: set[str]) -> bool:
    """Whether an expression (or an annotation) is visibly a set."""
    if isinstance(node, ast.Set | ast.SetComp):
        return True
    if isinstance(node, ast.Call):
        return dotted(node.func) in ("set", "frozenset")
    if isinstance(node, ast.Subscript):
        return dotted(node.value) in ("set", "frozenset")
    if isinstance(node, ast.BinOp) and isinstance(node.op, ast.BitOr | ast.BitAnd | ast.Sub
                                                  | ast.BitXor):
        return any(is_set(side, known) or (isinstance(side, ast.Call)
                                           and dotted(side.func).endswith(".keys"))
                   for side in (node.left, node.right))
    return bool(dotted(node)) and dotted(node) in known


def a_file_holds_one_idea(source: Source) -> Complaints:
    lines = source.text.count("\n")
    if lines > MAX_LINES:
        yield lines, f"{lines} lines; at most {MAX_LINES}"


RULES: list[Callable[[Source], Complaints]] = [
    desim_never_imports_netmodels,
    netmodels_sees_of_desim_only_the_contracts,
    robots_never_import_the_world,
    rooms_import_downwards,
    simpy_is_behind_the_kernel,
    numba_is_in_kernels_files,
    kernels_are_compiled_at_import_cached_and_exact,
    kernels_take_transcendentals_from_one_module,
    only_the_surface_prints,
    random_numbers_come_by_name,
    only_reports_read_the_wall_clock,
    nothing_depends_on_the_process,
    sets_are_never_iterated,
    a_file_holds_one_idea,
]


@pytest.mark.parametrize("rule", RULES, ids=lambda rule: rule.__name__)
def test_rule(rule):
    broken = [f"{source.path}:{line}: {complaint}" for source in sources().values()
              for line, complaint in rule(source)]
    assert not broken, "\n" + "\n".join(broken)


# ------------------------------------------------------------- the twins: every rule can be broken

TWINS = [
    (desim_never_imports_netmodels, "desim/a.py", "import netmodels.disk"),
    (netmodels_sees_of_desim_only_the_contracts, "netmodels/a.py", "from desim import kernel"),
    (netmodels_sees_of_desim_only_the_contracts, "netmodels/a.py", "import desim.engine.streams"),
    (robots_never_import_the_world, "desim/robot/a.py", "from desim import world"),
    (robots_never_import_the_world, "desim/robot/a.py", "from ..world.bodies import Bodies"),
    (rooms_import_downwards, "desim/world/a.py", "from desim.middleware import graph"),
    (rooms_import_downwards, "desim/campaign/design/a.py", "import desim.campaign.running.crew"),
    (simpy_is_behind_the_kernel, "netmodels/a.py", "from simpy import Store"),
    (numba_is_in_kernels_files, "desim/world/a.py", "import numba"),
    (kernels_are_compiled_at_import_cached_and_exact, "desim/ports/kernels.py",
     "@njit\ndef f(x):\n    return x"),
    (kernels_are_compiled_at_import_cached_and_exact, "desim/ports/kernels.py",
     "@numba.njit('f8(f8)', cache=True, fastmath=True)\ndef f(x):\n    return x"),
    (kernels_take_transcendentals_from_one_module, "desim/world/kernels/lidar.py",
     "y = math.sin(x)"),
    (kernels_take_transcendentals_from_one_module, "netmodels/radio/kernels.py",
     "from numpy import exp"),
    (only_the_surface_prints, "desim/world/a.py", "print('hello')"),
    (only_the_surface_prints, "desim/experiment/a.py", "from rich.table import Table"),
    (random_numbers_come_by_name, "desim/a.py", "import random"),
    (random_numbers_come_by_name, "desim/a.py", "x = np.random.default_rng(3)"),
    (only_reports_read_the_wall_clock, "desim/robot/a.py", "from time import perf_counter"),
    (nothing_depends_on_the_process, "desim/a.py", "order = hash('name')"),
    (sets_are_never_iterated, "desim/a.py", "for x in {1, 2}:\n    y = x"),
    (sets_are_never_iterated, "desim/a.py", "peers: set[int] = f()\nz = [x for x in peers]"),
    (sets_are_never_iterated, "desim/a.py", "self.a = set()\nb = list(self.a)"),
    (sets_are_never_iterated, "desim/a.py", "b = [*(a.keys() - c)]"),
    (a_file_holds_one_idea, "desim/a.py", "\n" * (MAX_LINES + 1)),
]


@pytest.mark.parametrize("rule, path, text", TWINS)
def test_rule_sees_its_breach(rule, path, text):
    assert list(rule(Source.of(path, text)))


def test_a_longer_way_to_the_world_is_seen_too(monkeypatch):
    files = [Source.of("desim/near.py", "from desim import far"),
             Source.of("desim/far.py", "import desim.world.bodies")]
    monkeypatch.setattr(sys.modules[__name__], "sources",
                        lambda: {file.module: file for file in files})
    assert way_to_the_world("desim.near.thing") == ["desim.near.thing", "desim.far",
                                                    "desim.world.bodies"]


def test_every_rule_has_a_twin():
    assert {rule for rule, _, _ in TWINS} == set(RULES)


# ------------------------------------------------------------------------------------ class names

def class_names_used_twice(files: Iterable[Source]) -> dict[str, list[str]]:
    """The files of each name that several public classes at the top level of a file have."""
    found: dict[str, list[str]] = {}
    for source in files:
        for node in source.tree.body:
            if isinstance(node, ast.ClassDef) and not node.name.startswith("_"):
                found.setdefault(node.name, []).append(str(source.path))
    return {name: paths for name, paths in found.items() if len(paths) > 1}


def test_no_public_class_name_is_used_twice():
    assert class_names_used_twice(sources().values()) == {}


def test_a_class_name_that_is_used_twice_is_found():
    one, other = (Source.of(f"desim/{name}.py", "class Link:\n    class Params: ...\nclass _A: ...")
                  for name in "ab")
    assert class_names_used_twice([one, other]) == {"Link": ["desim/a.py", "desim/b.py"]}


# ---------------------------------------------------------------------------------- starting time


def test_help_imports_nothing_heavy():
    done = subprocess.run(
        [sys.executable, "-X", "importtime", "-m", "desim.cli", "--help"],
        capture_output=True, text=True, timeout=60, check=True)
    assert "Usage" in done.stdout
    imported = {line.rpartition("|")[2].strip().split(".")[0]
                for line in done.stderr.splitlines() if line.startswith("import time:")}
    assert "typer" in imported
    assert not imported & {"numba", "matplotlib", "networkx"}
