"""Compiled kernels: what they compute, what they refuse, and how they are kept."""

from __future__ import annotations

import json
import os
import resource
import subprocess
import sys
from functools import partial
from pathlib import Path
from shutil import copytree, ignore_patterns
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numba import njit

from desim.compiler import folder, machine_code, store
from desim.compiler.kernel import compiled_function, kernels_of
from desim.errors import InputError
from desim.ports.kernels import kernel, lean, types, uniform
from desim.robot.mapping.kernels.tiles import drop, hold_all, make_own
from desim.world.kernels.contact import deeper

# ------------------------------------------------------------------------------- what they compute

_triple = types.UniTuple(types.float64, 3)


@lean(_triple(types.int64, types.uint64, types.float64))
def numbers(a, b, c):
    return a, b, c


@lean("b1(b1, i4, f4)")
def small(flag, whole, part):
    return flag and whole == -7 and part == np.float32(0.1)


@kernel("f8(f8[:, ::1], i8)")
def by_rows(values, times):
    """The sum of ``values``, over arrays that the kernel makes itself."""
    total = 0.0
    for _ in range(times):
        sums = np.zeros(values.shape[0] + 100_000)
        for r in range(values.shape[0]):
            for c in range(values.shape[1]):
                sums[r] += values[r, c]
        total += sums.sum()
    return total


@lean("f8(f8, f8)")
def quotient(a, b):
    return a / b


@kernel("i8(i8, i8)")
def whole_quotient(a, b):
    return a // b


@lean("i8(i8[:])")
def last(values):
    return values[-1]


@kernel("i8(i8)")
def digits(x):
    """It needs numba's own library for text."""
    return len(str(x))


@given(st.integers(-2**63, 2**63 - 1), st.integers(0, 2**64 - 1), st.floats(allow_nan=False))
def test_numbers_arrive_as_they_are(a, b, c):
    assert numbers(a, b, c) == (float(a), float(b), c)
    assert numbers(np.int64(a), np.uint64(b), np.float64(c)) == (float(a), float(b), c)


def test_narrow_numbers_and_truths():
    assert small(True, -7, 0.1) is True
    assert small(1, np.int32(-7), np.float32(0.1)) is True
    assert small(False, -7, 0.1) is False


@given(st.integers(1, 6), st.integers(1, 6))
def test_an_array_is_read_where_it_lies(rows, columns):
    values = np.arange(float(rows * columns)).reshape(rows, columns)
    assert by_rows(values, 1) == values.sum()


def test_a_kernel_can_be_called_inside_numbas_functions():
    """As plug-ins that compile by themselves do."""
    @njit
    def twice(key, counter):
        return 2.0 * uniform(key, counter)

    key, counter = np.uint64(7), np.uint64(11)
    assert twice(key, counter) == 2.0 * uniform(key, counter)


def test_memory_of_a_call_is_given_back():
    before_kb = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    by_rows(np.ones((3, 3)), 2000)  # 1.6 GB in all
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before_kb < 100_000


def test_a_kernel_of_kernels_can_be_called_too():
    assert drop.is_inner and make_own.is_inner
    assert deeper(0.3, 0.4, 1.0, (0.0, 0.0, 0.0)) == (0.5, 0.6, 0.8)


def test_what_numba_needs_its_library_for_runs_with_it():
    assert digits(12345) == 5


# ------------------------------------------------------------------------------- what they refuse


def test_division_by_zero_is_an_error_or_infinite():
    assert quotient(1.0, 0.0) == float("inf")
    with pytest.raises(ArithmeticError, match="^whole_quotient divided by zero, or ran out"):
        whole_quotient(1, 0)


@pytest.mark.parametrize("arguments, error", [
    ((1, 2), "numbers takes 3 arguments"),
    ((1.5, 2, 3.0), "'float' object cannot be interpreted as an integer"),
    ((1, 2.5, 3.0), "'float' object cannot be interpreted as an integer"),
    ((1, 2, "3"), "must be real number, not str")])
def test_wrong_numbers_are_refused(arguments, error):
    with pytest.raises(TypeError, match=f"^{error}$"):
        numbers(*arguments)


@pytest.mark.parametrize("arguments", [(2**63, 2, 3.0), (1, -1, 3.0), (1, 2**64, 3.0)])
def test_numbers_that_do_not_fit_are_refused(arguments):
    with pytest.raises(OverflowError):
        numbers(*arguments)


@pytest.mark.parametrize("values", [
    [[1.0]], np.ones(3), np.ones((2, 2), np.float32), np.ones((2, 2), np.int64),
    np.ones((4, 4))[::2], np.ones((2, 2)).astype(">f8").byteswap()[:, ::-1]])
def test_another_array_is_refused(values):
    with pytest.raises(TypeError, match=r"^by_rows: argument 1 is not a numpy array of 2 dimensions"
                                        r" of float64, contiguous$|dimensions of float64$"):
        by_rows(values, 1)


def test_strides_are_followed_where_they_are_allowed():
    assert last(np.arange(10)[::-3]) == 0


def test_long_and_long_long_are_one():
    assert last(np.arange(3, dtype=np.longlong)) == 2


def test_a_tuple_of_another_length_is_refused():
    with pytest.raises(TypeError, match="^drop: argument 2 is not a tuple of 4$"):
        drop(1, (np.zeros((1, 1024), np.int8),))


def test_a_kernel_is_called_without_a_way_over_its_object():
    refs = np.zeros(4, np.int32)
    compiled_function(hold_all)(np.array([0, 2, 2], np.int32), refs)
    assert refs.tolist() == [0, 0, 2, 0]
    with pytest.raises(TypeError):
        compiled_function(hold_all)(np.array([0, 2, 2], np.int64), refs)
    assert compiled_function(abs) is abs  # what a kernel is with NUMBA_DISABLE_JIT: a function


KEPT_TO_THE_END = """
from desim.world.kernels.flood import flood
around = [flood.function]
around.append(around)  # so that it is left to the collection of garbage at the end
"""


def test_a_function_that_is_left_at_the_end_refers_to_nothing_freed():
    """glibc fills what is freed with 2s, which are the flag METH_METHOD of a function: a class."""
    output_of(KEPT_TO_THE_END, **os.environ, PYTHONMALLOC="malloc", MALLOC_PERTURB_="2")


# ------------------------------------------------------------------------------ how they are kept

PRINT_FOLDER = "import os, desim; print(os.environ['NUMBA_CACHE_DIR'])"


def output_of(code, *arguments, **environment):
    return subprocess.run([sys.executable, "-c", code, *arguments], env=environment, text=True,
                          capture_output=True, check=True).stdout.strip()


def test_the_folder_is_the_users_and_named_by_the_sources(tmp_path):
    chosen = output_of(PRINT_FOLDER, XDG_CACHE_HOME=str(tmp_path))
    assert chosen.startswith(f"{tmp_path}/desim/kernels-")
    assert chosen == output_of(PRINT_FOLDER, XDG_CACHE_HOME=str(tmp_path))


def test_a_folder_that_the_user_names_is_taken(tmp_path):
    assert output_of(PRINT_FOLDER, NUMBA_CACHE_DIR=str(tmp_path)) == str(tmp_path)


def test_without_a_writable_home_there_are_the_temporary_files(tmp_path):
    nowhere = tmp_path / "file"
    nowhere.write_text("")
    chosen = output_of(PRINT_FOLDER, XDG_CACHE_HOME=str(nowhere), TMPDIR=str(tmp_path))
    assert chosen.startswith(f"{tmp_path}/desim-")


@pytest.mark.parametrize("spoil", [
    pytest.param(lambda own: own.chmod(0o770), id="others can write"),
    pytest.param(lambda own: (own.rename(own.with_name("taken")), own.symlink_to("taken")),
                 id="a link"),
    pytest.param(lambda own: os.chown(own, 65534, 65534), id="another user's",
                 marks=pytest.mark.skipif(os.getuid() != 0, reason="only root gives folders away")),
])
def test_a_folder_that_is_not_the_users_alone_is_never_taken(tmp_path, spoil):
    """Its files would run as machine code."""
    home = tmp_path / "home"
    environment = {"XDG_CACHE_HOME": str(home), "TMPDIR": str(tmp_path)}
    own = Path(output_of(PRINT_FOLDER, **environment))
    assert own.parent == home / "desim"
    assert own.stat().st_mode & 0o777 == own.parent.stat().st_mode & 0o777 == 0o700
    spoil(own)
    other = Path(output_of(PRINT_FOLDER, **environment))
    assert other == tmp_path / f"desim-{os.getuid()}" / own.name
    spoil(other.parent)
    private = Path(output_of(PRINT_FOLDER, **environment))
    assert private.parent == tmp_path and private != other.parent
    assert not private.exists()  # it went with its process


def test_the_name_changes_with_any_kernel_file(tmp_path, monkeypatch):
    (tmp_path / "a").mkdir()
    (tmp_path / "a" / "kernels.py").write_text("x = 1")
    monkeypatch.setattr(folder, "find_spec",
                        lambda package: SimpleNamespace(origin=str(tmp_path / "__init__.py")))
    before = folder._fingerprint()
    (tmp_path / "a" / "kernels.py").write_text("x = 2")
    assert folder._fingerprint() != before


KERNELS = """
from desim.ports.kernels import inner, lean
from lengths import FOOT_M
from more_kernels import doubled

@lean("f8(f8)")
def two_feet(x):
    return doubled(x) * FOOT_M

@lean("f8(f8[::1])")
def first(values):
    return values[0]
"""
MORE = """
from desim.ports.kernels import inner

@inner("f8(f8)")
def doubled(x):
    return 2.0 * x
"""
# Prints what the kernel says, whether it was compiled, and whether numba was imported.
CALL = """
import json, pathlib, sys
sys.path.insert(0, sys.argv[1])
import desim
from desim.compiler import store
store.SHIPPED = pathlib.Path(sys.argv[1]) / "shipped"
said = []
with store.announced(lambda: said.append(True)):
    import some_kernels
    found = some_kernels.two_feet(1.0)
try:
    some_kernels.first([found])
except TypeError as error:
    assert str(error).startswith("first: argument 1 is not a numpy array"), error
print(json.dumps([found, bool(said), "numba" in sys.modules]))
"""

SHIP = """
import pathlib, sys
sys.path.insert(0, sys.argv[1])
import some_kernels
from desim.compiler import store
from desim.compiler.kernel import kernels_of
store.ship(list(kernels_of("some_kernels").values()), pathlib.Path(sys.argv[1]) / "shipped")
"""


def called(folder, **changes):
    """Call somebody's kernel in a process of its own; ``changes`` of the process's environment."""
    return json.loads(output_of(CALL, str(folder), **{
        **os.environ, "NUMBA_CACHE_DIR": str(folder / "cache"), **changes}))


@pytest.fixture(scope="module")
def compiled(tmp_path_factory):
    """A folder of somebody's kernels that were called once."""
    folder = tmp_path_factory.mktemp("compiled")
    (folder / "some_kernels.py").write_text(KERNELS)
    (folder / "more_kernels.py").write_text(MORE)
    (folder / "lengths.py").write_text("FOOT_M = 0.25\n")
    assert called(folder) == [0.5, True, True]
    return folder


@pytest.fixture
def somebodys(compiled, tmp_path):
    """Calls the kernel in a copy of that folder."""
    copytree(compiled, tmp_path, dirs_exist_ok=True, ignore=ignore_patterns("__pycache__"))
    return partial(called, tmp_path)


def kept(tmp_path):
    return sorted((tmp_path / "cache").glob("*.o"))


def test_a_module_is_compiled_once_and_then_loaded_without_numba(somebodys, tmp_path):
    assert [path.name.split("-")[0] for path in kept(tmp_path)] == ["some_kernels"]
    assert somebodys() == [0.5, False, False]


@pytest.mark.parametrize("file, old, new, found", [
    ("some_kernels.py", "* FOOT_M", "* 3.0 * FOOT_M", 1.5),
    ("more_kernels.py", "2.0 * x", "4.00 * x", 1.0),
    ("lengths.py", "0.25", "0.5", 1.0)])
def test_what_a_kernel_calls_and_its_constants_are_part_of_its_name(somebodys, tmp_path, file, old,
                                                                   new, found):
    text = (tmp_path / file).read_text()
    (tmp_path / file).write_text(text.replace(old, new))
    assert somebodys() == [found, True, True]
    (tmp_path / file).write_text(text)
    assert somebodys() == [0.5, False, False]
    assert len(kept(tmp_path)) == 2


def test_another_processor_has_other_machine_code(somebodys, tmp_path):
    assert somebodys(NUMBA_CPU_NAME="generic", NUMBA_CPU_FEATURES="") == [0.5, True, True]
    assert len(kept(tmp_path)) == 2


@pytest.fixture
def shipped(somebodys, tmp_path):
    """``somebodys`` with machine code for another processor of its kind, and none of its own."""
    output_of(SHIP, str(tmp_path), **{**os.environ, "NUMBA_CPU_NAME": machine_code.SHIPPED_CPU,
                                      "NUMBA_CPU_FEATURES": ""})
    for path in kept(tmp_path):
        path.unlink()
    return somebodys


@pytest.mark.skipif(not machine_code.runs_shipped(), reason="Linux on x86-64-v3 alone runs it")
def test_shipped_machine_code_is_called_without_compiling(shipped, tmp_path):
    assert shipped() == [0.5, False, False]
    assert kept(tmp_path) == []


def test_it_is_not_that_of_other_sources(shipped, tmp_path):
    (tmp_path / "lengths.py").write_text("FOOT_M = 0.5\n")
    assert shipped() == [1.0, True, True]


def test_nor_what_somebody_wants_who_sets_variables_of_numba(shipped):
    assert shipped(NUMBA_BOUNDSCHECK="1") == [0.5, True, True]


def test_nor_run_on_an_older_processor(monkeypatch):
    monkeypatch.setattr(machine_code.llvm, "get_host_cpu_features", lambda: {
        "avx": True, "avx2": False, "bmi": True})
    assert not machine_code.runs_shipped()


def test_a_file_that_is_not_whole_is_compiled_again(somebodys, tmp_path):
    [path] = kept(tmp_path)
    whole = path.read_bytes()
    assert store._read(path) is not None
    for spoilt in (b"", b"[1]\n", b"\xff\n", whole[:-1],
                   whole.replace(b"PyFloat_AsDouble", b"PyFloat_AsDoublf", 1)):
        path.write_bytes(spoilt)
        assert store._read(path) is None
    assert somebodys() == [0.5, True, True]
    assert path.read_bytes() == whole


def test_where_nothing_can_be_written_one_line_says_so(tmp_path, monkeypatch):
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "file" / "cache"))
    fresh = [one for one in kernels_of(__name__).values() if one.__name__ == "quotient"]
    with pytest.raises(InputError) as refused:
        store.functions(fresh, keep=True)
    assert str(refused.value) == (
        f"compiled kernels cannot be kept in {tmp_path}/file/cache (Not a directory); set "
        "NUMBA_CACHE_DIR to a folder that can be written")


# Prints the modules that a command imports, and those whose kernels it calls.
COMMAND = """
import sys, desim.cli
from desim.compiler.kernel import kernels_of
desim.cli.app(sys.argv[1:], standalone_mode=False)
print(*sys.modules)
print(*(name for name in list(sys.modules)
        if any("function" in vars(kernel) for kernel in kernels_of(name).values())))
"""


def test_a_run_with_kept_kernels_imports_nothing_heavy(repository, tmp_path):
    command = ["run", str(repository / "scenarios" / "hello.yaml"), "--quiet", "--out",
               str(tmp_path)]
    output_of(COMMAND, *command, **os.environ)  # kept from here on
    modules, of_kernels = output_of(COMMAND, *command, **os.environ).splitlines()
    used = set(of_kernels.split())
    assert used >= {"desim.robot.mapping.kernels.evidence", "desim.world.kernels.lidar",
                    "netmodels.switch.kernels.machine"}
    # Nothing of what this scenario has not: radios, noisy odometers, walls in a map's image.
    assert not any(name.startswith("netmodels.radio") for name in used)
    assert not used & {"desim.world.kernels.crossings", "desim.world.kernels.odometry",
                       "desim.world.kernels.thinning"}
    loaded = {name.split(".")[0] for name in modules.split()}
    assert "llvmlite" in loaded
    assert not loaded & {"numba", "scipy", "networkx", "matplotlib"}
