"""Compiled kernels are kept where a change of any kernel file leads to another folder."""

import subprocess
import sys
from types import SimpleNamespace

import numpy as np
import pytest

PRINT_FOLDER = "import os, desim; print(os.environ['NUMBA_CACHE_DIR'])"


def chosen(**environment):
    return subprocess.run([sys.executable, "-c", PRINT_FOLDER], env=environment, text=True,
                          capture_output=True, check=True).stdout.strip()


def test_the_folder_is_the_users_and_named_by_the_sources(tmp_path):
    folder = chosen(XDG_CACHE_HOME=str(tmp_path))
    assert folder.startswith(f"{tmp_path}/desim/kernels-")
    assert folder == chosen(XDG_CACHE_HOME=str(tmp_path))


def test_a_folder_that_the_user_names_is_taken(tmp_path):
    assert chosen(NUMBA_CACHE_DIR=str(tmp_path)) == str(tmp_path)


def test_without_a_writable_home_there_are_the_temporary_files(tmp_path):
    nowhere = tmp_path / "file"
    nowhere.write_text("")
    folder = chosen(XDG_CACHE_HOME=str(nowhere), TMPDIR=str(tmp_path))
    assert folder.startswith(f"{tmp_path}/desim-")


def test_the_name_changes_with_any_kernel_file(tmp_path, monkeypatch):
    from desim.engine import compiled

    (tmp_path / "a").mkdir()
    (tmp_path / "a" / "kernels.py").write_text("x = 1")
    monkeypatch.setattr(compiled, "find_spec",
                        lambda package: SimpleNamespace(origin=str(tmp_path / "__init__.py")))
    before = compiled._fingerprint()
    (tmp_path / "a" / "kernels.py").write_text("x = 2")
    assert compiled._fingerprint() != before


def test_a_kernel_is_called_without_its_dispatcher():
    from desim.engine.compiled import compiled_function
    from desim.robot.kernels.tiles import hold_all

    refs = np.zeros(4, np.int32)
    compiled_function(hold_all)(np.array([0, 2, 2], np.int32), refs)
    assert refs.tolist() == [0, 0, 2, 0]
    with pytest.raises(TypeError):  # numba still checks the size of an item
        compiled_function(hold_all)(np.array([0, 2, 2], np.int64), refs)
    assert compiled_function(abs) is abs  # what a kernel is with NUMBA_DISABLE_JIT: a function
