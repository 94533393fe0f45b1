"""All kernels of desim and netmodels can be kept: a second process compiles none, without numba."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

from compile_kernels import modules_of_kernels

# Loads the kernels of modules, and prints the modules of which some were compiled or are numba's.
LOAD = """
import sys
from importlib import import_module
sys.path.insert(0, sys.argv[1])
import desim
from desim.compiler.kernel import kernels_of
from desim.compiler.store import compiling_s
for name in sys.argv[2:]:
    import_module(name)
    before = compiling_s()
    functions = [one.function for one in kernels_of(name).values() if not one.is_inner]
    if compiling_s() != before or any(type(one) is not type(len) for one in functions):
        print(name)
"""
ALL_CAN_BE_KEPT = """
from desim.ports.kernels import kernel

@kernel("i8(i8)")
def twice(x):
    return 2 * x
"""
ONE_CANNOT = ALL_CAN_BE_KEPT + """
@kernel("i8(i8)")
def digits(x):
    return len(str(x))  # numba's own library for text
"""


def loaded_anew(modules: list[str], folder: Path, **environment: str) -> list[str]:
    """The modules whose kernels a second process has to compile or to import numba for."""
    for _ in range(2):
        done = subprocess.run([sys.executable, "-c", LOAD, str(folder), *modules], check=True,
                              env=os.environ | environment, text=True, capture_output=True)
    return done.stdout.split()


def test_every_kernel_of_ours_can_be_kept(repository, tmp_path):
    modules = modules_of_kernels(repository)
    assert {"desim.ports.kernels", "desim.world.kernels.bodies",
            "netmodels.radio.dcf.kernels.machine"} < set(modules)
    assert loaded_anew(modules, tmp_path) == []


def test_a_kernel_that_cannot_be_kept_is_found(tmp_path):
    (tmp_path / "kept.py").write_text(ALL_CAN_BE_KEPT)
    (tmp_path / "not_kept.py").write_text(ONE_CANNOT)
    assert loaded_anew(["kept", "not_kept", "desim.ports.kernels"], tmp_path,
                       NUMBA_CACHE_DIR=str(tmp_path / "cache")) == ["not_kept"]
