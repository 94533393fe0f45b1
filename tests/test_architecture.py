"""The rules of the design, as far as a test can see them. Each complaint is a file and a line."""

from __future__ import annotations

import ast
import subprocess
import sys
from collections.abc import Callable, Iterable, Iterator
from functools import cache
from importlib.metadata import entry_points
from pathlib import Path

import pytest
from packages import LAYERS, casts_and_ignores, counted, counts_by_layer
from sources import ROOT, Source, below, dotted, nodes

MAX_LINES = 400
MAX_ANY = 100  # names ``Any`` in desim and netmodels: below this
MAX_CASTS = 30  # casts and ignores there

# Files that may read the wall clock: they report on a run or its cost, and never change it.
WALL_CLOCK = {"desim/report/live/feed.py",
              "desim/campaign/running/probes.py", "desim/campaign/running/crew.py",
              "desim/campaign/running/driver.py", "desim/compiler/store.py",
              "desim/commands/compiling.py", "desim/commands/slam.py", "desim/api.py",
              "desim/results/folder.py",
              "desim/commands/views/progress.py", "desim/commands/views/results_list.py",
              "desim/commands/views/sweep.py",
              # Real programs have a clock of their own, and the guest has to be waited for.
              "desim/loop/clock.py", "desim/loop/supervision.py"}
# Who may name the global generators: the makers of streams, and the check that a plug-in draws
# nothing from them.
GLOBAL_GENERATORS = {"desim/engine/streams.py", "desim/testing/checks.py",
                     "desim/report/live/foxglove.py"}  # the last: an address nobody can guess
# Who may reach a module by a name that is a value: no rule sees such an import.
BY_NAME = {"desim/__init__.py": "what it exports is imported when it is first used",
           "desim/plugins.py": "plug-ins are found by entry point",
           "desim/modules.py": "plug-ins are found by dotted path",
           "desim/compiler/folder.py": "numba's settings, if numba is imported already",
           "desim/compiler/store.py": "machine code depends on the files of the kernels in it",
           "desim/results/identity.py": "a run's id depends on the files of its plug-ins",
           "desim/campaign/running/schedulers.py": "dask-jobqueue is an extra"}
IMPORTERS = {"import_module", "__import__", "reload", "exec_module", "load_module", "find_loader",
             "module_from_spec", "spec_from_file_location", "resolve_name", "run_module",
             "run_path", "entry_points", "EntryPoint"}
TRANSCENDENTAL = {"sin", "cos", "tan", "asin", "acos", "atan", "atan2", "arcsin", "arccos",
                  "arctan", "arctan2", "sinh", "cosh", "tanh", "exp", "exp2", "expm1", "log",
                  "log2", "log10", "log1p", "pow", "power", "hypot"}

# What only some systems have. ctypes: the compiler calls CPython by it, on every system.
OF_SOME_SYSTEMS = {"fcntl", "resource", "msvcrt", "winreg", "termios", "tty", "pwd", "grp",
                   "select", "syslog", "mmap", "ctypes"}
CALLS_CPYTHON = {"desim/compiler/machine_code.py"}
# Of os, signal and socket; ``dir_fd`` and /proc beside.
NAMES_OF_SOME_SYSTEMS = {
    "killpg", "getuid", "geteuid", "getgid", "setsid", "getpgid", "fork", "waitid", "pidfd_open",
    "sched_getaffinity", "sched_setaffinity", "register_at_fork", "sysconf", "set_blocking",
    "mkfifo", "nice", "getloadavg", "uname", "chown", "O_NOFOLLOW", "O_DIRECTORY", "O_NONBLOCK",
    "O_CLOEXEC", "SIGKILL", "SIGHUP", "SIGUSR1", "SIGALRM", "setitimer", "alarm", "pthread_sigmask",
    "pthread_kill", "sigwait", "sigwaitinfo", "waitpid", "AF_UNIX", "fsync"}

KERNELS = ("kernel", "lean", "inner")  # the decorators of compiled functions

Complaints = Iterator[tuple[int, str]]


def inside(name: str, *packages: str) -> bool:
    return any(name == package or name.startswith(package + ".") for package in packages)


@cache
def sources() -> dict[str, Source]:
    """Module name to source, of both packages, but for the programs that the judge runs beside our
    models: they know nothing of desim."""
    return {name: source for name, source in below("desim", "netmodels").items()
            if not inside(name, "desim.validation.real.programs")}


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


# The layers of the campaign, from the lowest up.
CAMPAIGN = ["design", "folder", "running", "deploy"]


def packages_import_downwards(source: Source) -> Complaints:
    parts = source.module.split(".")
    for line, name in source.imports():
        found = name.split(".")
        if parts[0] != "desim" or found[0] != "desim" or len(parts) == 1 or len(found) == 1:
            continue
        if name == "desim.__version__":
            continue
        unknown = [layer for layer in (found[1], parts[1]) if layer not in LAYERS]
        if unknown:
            yield line, f"imports {name}; LAYERS has no {unknown[0]!r}"
        elif LAYERS.index(found[1]) > LAYERS.index(parts[1]):
            yield line, f"imports {name}; {parts[1]} is below {found[1]}"
        elif parts[1] == found[1] == "campaign" and len(parts) > 2 and len(found) > 2:
            unknown = [layer for layer in (found[2], parts[2]) if layer not in CAMPAIGN]
            if unknown:
                yield line, f"imports {name}; CAMPAIGN has no {unknown[0]!r}"
            elif CAMPAIGN.index(found[2]) > CAMPAIGN.index(parts[2]):
                yield line, f"imports {name}; {parts[2]} is below {found[2]}"


def no_module_binds_desim_as_a_whole(source: Source) -> Complaints:
    """With the name ``desim``, all that anybody has imported is at hand: ``desim.world``."""
    for node in nodes(source.tree):
        if isinstance(node, ast.Import):
            for alias in node.names:
                if alias.name == "desim" or inside(alias.name, "desim") and not alias.asname:
                    yield node.lineno, f"binds desim; write: from {alias.name} import ..."
        elif isinstance(node, ast.ImportFrom) and any(alias.name == "*" for alias in node.names):
            yield node.lineno, "imports *; name what is used"


def only_listed_files_import_by_name(source: Source) -> Complaints:
    if str(source.path) not in BY_NAME:
        yield from imports_by_name(source)


def imports_by_name(source: Source) -> Complaints:
    """Every use of a function that imports a module whose name is a value."""
    for node in nodes(source.tree):
        match node:
            case ast.Name(id=name) | ast.Attribute(attr=name) | ast.alias(name=name):
                whole = dotted(node) if isinstance(node, ast.expr) else name
                if name in IMPORTERS or whole == "sys.modules":
                    yield node.lineno, f"uses {whole}; only the files of BY_NAME may"


def simpy_is_behind_the_kernel(source: Source) -> Complaints:
    if str(source.path) != "desim/engine/kernel.py":
        for line, name in source.imports():
            if inside(name, "simpy"):
                yield line, "imports simpy; only desim/engine/kernel.py may"


def numba_is_behind_the_compiler(source: Source) -> Complaints:
    if not inside(source.module, "desim.compiler"):
        for line, name in source.imports():
            if inside(name, "numba"):
                yield line, "imports numba; take what declares kernels from desim/ports/kernels.py"


def nothing_listens_to_imports(source: Source) -> Complaints:
    for node in nodes(source.tree):
        if isinstance(node, ast.Attribute) and dotted(node) == "sys.meta_path":
            yield node.lineno, "hooks into imports; desim/compiler/store.py announces what compiles"


def plug_ins_declare_their_traits(source: Source) -> Complaints:
    for node in nodes(source.tree):
        match node:
            case ast.Call(func=ast.Name("getattr"), args=[ast.Call(
                    func=ast.Name("load") | ast.Attribute(attr="load")), *_]):
                yield node.lineno, "asks a plug-in by a name; declare it in desim/ports/ as Traits"


def kernels_are_in_kernels_files(source: Source) -> Complaints:
    if not is_kernels(source) and not inside(source.module, "desim.compiler"):
        for line, name in source.imports():
            if name in {f"desim.ports.kernels.{each}" for each in KERNELS}:
                yield line, f"imports {name}; only kernels.py and files in kernels/ may"


def is_kernels(source: Source) -> bool:
    """Whether a file is called ``kernels.py``, or is in a package ``kernels``."""
    return source.path.name == "kernels.py" or source.path.parent.name == "kernels"


def kernels_have_signatures(source: Source) -> Complaints:
    for node in nodes(source.tree):
        if not isinstance(node, ast.FunctionDef):
            continue
        for decorator in node.decorator_list:
            call = decorator if isinstance(decorator, ast.Call) else None
            name = dotted(call.func if call else decorator).split(".")[-1]
            if name in KERNELS and (not call or not call.args):
                yield node.lineno, f"{node.name}: a signature is missing"


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


def systems_differ_in_one_package(source: Source) -> Complaints:
    if inside(source.module, "desim.operating_system", "desim.loop"):  # the latter: Linux alone
        return
    if str(source.path) not in CALLS_CPYTHON:
        for line, name in source.imports():
            if name.split(".")[0] in OF_SOME_SYSTEMS:
                yield line, f"imports {name}; ask desim.operating_system"
    for node in nodes(source.tree):
        if isinstance(node, ast.Attribute) and node.attr in NAMES_OF_SOME_SYSTEMS and dotted(
                node.value) in ("os", "signal", "socket"):
            yield node.lineno, f"names {ast.unparse(node)}; ask desim.operating_system"
        elif isinstance(node, ast.keyword) and node.arg in ("dir_fd", "pass_fds", "preexec_fn"):
            yield node.value.lineno, f"passes {node.arg}; ask desim.operating_system"
        elif isinstance(node, ast.Constant) and str(node.value).startswith("/proc/"):
            yield node.lineno, f"names {node.value}; ask desim.operating_system"


def text_is_utf_8(source: Source) -> Complaints:
    """Elsewhere Python takes the system's encoding, which is another one on Windows."""
    for line, name, call in source.calls():
        given = len(call.args) + len(call.keywords)
        method = name.split(".")[-1]
        if method == "read_text" and not given or method == "write_text" and given < 2:
            yield line, f"calls {name} without an encoding"


def sets_are_never_iterated(source: Source) -> Complaints:
    known = {name for name, value in assignments(source.tree) if is_set(value, set())}
    for node in nodes(source.tree):
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
    for node in nodes(tree):
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


def casts_have_a_reason(source: Source) -> Complaints:
    for line, reason in casts_and_ignores(source.text):
        if not reason:
            yield line, "no comment here, or on the line above, says why mypy is overruled"


def a_file_holds_one_idea(source: Source) -> Complaints:
    lines = source.text.count("\n")
    if lines > MAX_LINES:
        yield lines, f"{lines} lines; at most {MAX_LINES}"


RULES: list[Callable[[Source], Complaints]] = [
    desim_never_imports_netmodels,
    netmodels_sees_of_desim_only_the_contracts,
    robots_never_import_the_world,
    packages_import_downwards,
    no_module_binds_desim_as_a_whole,
    only_listed_files_import_by_name,
    simpy_is_behind_the_kernel,
    numba_is_behind_the_compiler,
    nothing_listens_to_imports,
    plug_ins_declare_their_traits,
    kernels_are_in_kernels_files,
    kernels_have_signatures,
    kernels_take_transcendentals_from_one_module,
    only_the_surface_prints,
    random_numbers_come_by_name,
    only_reports_read_the_wall_clock,
    nothing_depends_on_the_process,
    systems_differ_in_one_package,
    text_is_utf_8,
    sets_are_never_iterated,
    casts_have_a_reason,
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
    (packages_import_downwards, "desim/world/a.py", "from desim.middleware import graph"),
    (packages_import_downwards, "desim/campaign/design/a.py", "import desim.campaign.running.crew"),
    (packages_import_downwards, "desim/world/a.py", "from desim import run"),
    (packages_import_downwards, "desim/engine/a.py", "from .. import Campaign"),
    (packages_import_downwards, "desim/cli.py", "from desim import attic"),
    (packages_import_downwards, "desim/attic/a.py", "from desim import units"),
    (packages_import_downwards, "desim/campaign/attic/a.py", "from desim.campaign.design import a"),
    (packages_import_downwards, "desim/campaign/deploy/a.py", "from ..attic import a"),
    (no_module_binds_desim_as_a_whole, "desim/world/a.py", "import desim"),
    (no_module_binds_desim_as_a_whole, "desim/world/a.py", "import desim as whole"),
    (no_module_binds_desim_as_a_whole, "netmodels/a.py", "import desim.ports"),
    (no_module_binds_desim_as_a_whole, "desim/world/a.py", "from desim import *"),
    (only_listed_files_import_by_name, "desim/world/a.py",
     "import importlib\nimportlib.import_module('desim.api')"),
    (only_listed_files_import_by_name, "desim/world/a.py",
     "from importlib import import_module as f"),
    (only_listed_files_import_by_name, "desim/world/a.py", "__import__('desim.api')"),
    (only_listed_files_import_by_name, "desim/world/a.py", "import sys\nsys.modules['desim.api']"),
    (simpy_is_behind_the_kernel, "netmodels/a.py", "from simpy import Store"),
    (numba_is_behind_the_compiler, "desim/world/kernels/a.py", "from numba import njit"),
    (nothing_listens_to_imports, "desim/a.py", "import sys\nsys.meta_path.insert(0, finder)"),
    (plug_ins_declare_their_traits, "desim/a.py",
     "from desim.plugins import load\ngetattr(load('task', name), 'gives', None)"),
    (plug_ins_declare_their_traits, "desim/a.py",
     "from desim import plugins\ngetattr(plugins.load('task', name), 'gives')"),
    (kernels_are_in_kernels_files, "desim/world/a.py", "from desim.ports.kernels import lean"),
    (kernels_have_signatures, "desim/ports/kernels.py", "@kernel\ndef f(x):\n    return x"),
    (kernels_have_signatures, "desim/ports/kernels.py", "@lean()\ndef f(x):\n    return x"),
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
    (systems_differ_in_one_package, "desim/a.py", "import fcntl"),
    (systems_differ_in_one_package, "desim/campaign/a.py", "from resource import getrlimit"),
    (systems_differ_in_one_package, "desim/a.py", "import ctypes"),
    (systems_differ_in_one_package, "desim/a.py", "os.killpg(1, 9)"),
    (systems_differ_in_one_package, "netmodels/a.py", "x = signal.SIGKILL"),
    (systems_differ_in_one_package, "desim/a.py", "os.stat(name, dir_fd=folder)"),
    (systems_differ_in_one_package, "desim/a.py", "Path('/proc/self/statm')"),
    (text_is_utf_8, "desim/a.py", "path.read_text()"),
    (text_is_utf_8, "desim/a.py", "beside.write_text(text)"),
    (sets_are_never_iterated, "desim/a.py", "for x in {1, 2}:\n    y = x"),
    (sets_are_never_iterated, "desim/a.py", "peers: set[int] = f()\nz = [x for x in peers]"),
    (sets_are_never_iterated, "desim/a.py", "self.a = set()\nb = list(self.a)"),
    (sets_are_never_iterated, "desim/a.py", "b = [*(a.keys() - c)]"),
    (casts_have_a_reason, "desim/a.py", "# why\n\nx = cast(int, y)"),
    (casts_have_a_reason, "desim/a.py", "x = typing.cast(int, y)"),
    (casts_have_a_reason, "desim/a.py", "x = y  # type: ignore[assignment]"),
    (casts_have_a_reason, "desim/a.py", "z = 1  # why\n_ = 2\nx = (\n    cast(int, y))"),
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


# -------------------------------------------------------------------------------------- plug-ins

PLUGINS = {"desim/robot/coordination/strategies": "desim.strategies",
           "desim/robot/sharing/kinds": "desim.sharing",
           "desim/robot/localization/kinds": "desim.localization",
           "desim/robot/navigation/local_planners": "desim.local_planners"}


def misplaced(folder: str, group: str) -> list[str]:
    """The modules in a folder that no entry point of ``group`` names, and those of desim that one
    names elsewhere."""
    package = folder.replace("/", ".")
    there = {f"{package}.{child}" for child in children_of(ROOT / folder)}
    named = {point.module for point in entry_points(group=group) if inside(point.module, "desim")}
    return sorted(there ^ named)


@pytest.mark.parametrize("folder", PLUGINS)
def test_a_robots_plugins_are_in_a_folder_of_their_own_with_nothing_else(folder):
    assert misplaced(folder, PLUGINS[folder]) == []


def test_a_module_beside_the_plugins_is_seen():
    elsewhere = misplaced("desim/robot/sharing", "desim.sharing")
    assert {"desim.robot.sharing.node", "desim.robot.sharing.kinds.scans"} <= set(elsewhere)


@pytest.mark.parametrize("path", BY_NAME)
def test_every_listed_file_imports_by_name(path):
    assert any(list(imports_by_name(source)) for source in sources().values()
               if str(source.path) == path)


# ------------------------------------------------------------------------------- layers and limits


def children_of(folder: Path) -> list[str]:
    """The packages and modules in a folder. Where only bytecode is left of one, it is gone."""
    return sorted(
        child.stem for child in folder.iterdir() if child.name not in ("__init__.py", "__pycache__")
        and (child.suffix == ".py" or child.is_dir() and (
            not any(child.iterdir())
            or any(file.is_file() and file.suffix != ".pyc" for file in child.rglob("*")))))


@pytest.mark.parametrize("folder, layers", [("desim", LAYERS), ("desim/campaign", CAMPAIGN)])
def test_every_package_has_its_layer(folder, layers):
    assert children_of(ROOT / folder) == sorted(layers)


def test_packages_and_modules_of_a_folder_are_found(tmp_path: Path):
    for name in ("attic", "gone/__pycache__", "__pycache__", "cellar"):
        (tmp_path / name).mkdir(parents=True)
    for name in ("__init__.py", "gone/__pycache__/a.pyc", "cellar/__init__.py", "door.py"):
        (tmp_path / name).touch()
    assert children_of(tmp_path) == ["attic", "cellar", "door"]


def test_types_are_rarely_opaque_or_overruled():
    everything = counts_by_layer()["all"]
    assert everything["Any"] < MAX_ANY and everything["casts"] <= MAX_CASTS


def test_any_casts_and_ignores_are_counted():
    count = counted("x: Any = cast(int, y)\nz: typing.Any = typing.cast(int, y)  # type: ignore\n"
                    "w: 'dict[str, Any]' = pc.cast(y, 1)\nq = 'type: ignore'")
    assert (count["statements"], count["Any"], count["casts"]) == (4, 3, 3)


@pytest.mark.parametrize("text", ["x = cast(int, y)  # why", "# why\nx = cast(int, y)",
                                  "x = cast(int,  # why\n         y)",
                                  "x = y  # type: ignore[assignment]  # why",
                                  "# why\nx = y  # type: ignore"])
def test_a_reason_is_seen(text):
    assert not list(casts_have_a_reason(Source.of("desim/a.py", text)))


# ------------------------------------------------------------------------------------ class names

def class_names_used_twice(files: Iterable[Source]) -> dict[str, list[str]]:
    """The files of each name that several public classes at the top level of a file have."""
    found: dict[str, list[str]] = {}
    for source in files:
        for name in sorted(public_classes(source.tree.body)):
            found.setdefault(name, []).append(str(source.path))
    return {name: paths for name, paths in found.items() if len(paths) > 1}


def public_classes(body: Iterable[ast.AST]) -> set[str]:
    """Names of classes at the top level, also under ``if`` and the like there."""
    found = set()
    for node in body:
        if isinstance(node, ast.ClassDef):
            found |= {node.name} if not node.name.startswith("_") else set()
        elif not isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.expr):
            found |= public_classes(ast.iter_child_nodes(node))
    return found


def test_no_public_class_name_is_used_twice():
    assert class_names_used_twice(sources().values()) == {}


def test_a_class_name_that_is_used_twice_is_found():
    one, other = (Source.of(f"desim/{name}.py", "class Link:\n    class Params: ...\nclass _A: ...")
                  for name in "ab")
    assert class_names_used_twice([one, other]) == {"Link": ["desim/a.py", "desim/b.py"]}


@pytest.mark.parametrize("text", [
    "if x:\n    class Link: ...", "if x: ...\nelse:\n    class Link: ...",
    "try: ...\nexcept ImportError:\n    class Link: ...", "with x:\n    class Link: ..."])
def test_a_class_under_a_condition_is_found(text):
    files = [Source.of("desim/a.py", "class Link: ..."), Source.of("desim/b.py", text)]
    assert class_names_used_twice(files) == {"Link": ["desim/a.py", "desim/b.py"]}


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
