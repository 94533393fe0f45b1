"""A run's name moves with the code that makes it, wherever that is installed."""

import os
import shutil
import subprocess
import sys

import pytest

ASK = "from desim.experiment.identity import source; print(source(()))"


def source_in(folder, path=""):
    """What the copy of desim in ``folder`` says that its source is, after a change of ``path``."""
    if path:
        with open(folder / "desim" / path, "a") as file:
            file.write("\nCHANGED = 1\n")
    found = subprocess.run([sys.executable, "-c", ASK], cwd=folder, check=True, text=True,
                           capture_output=True, env={**os.environ, "PYTHONPATH": str(folder)})
    return found.stdout.strip()


@pytest.fixture(scope="module")
def folders(repository, tmp_path_factory):
    """Two copies; the names of the folders above one of them are names of desim's own folders."""
    found = [tmp_path_factory.mktemp("copies") / folder
             for folder in ("plain", "report/campaign/statistics")]
    for folder in found:
        shutil.copytree(repository / "desim", folder / "desim",
                        ignore=shutil.ignore_patterns("__pycache__"))
    return found


def test_where_the_code_lies_says_nothing(folders):
    plain, below = map(source_in, folders)
    assert plain == below


@pytest.mark.parametrize("path, moves", [("kernel.py", True), ("campaign/plan.py", False)])
def test_a_change_of_what_computes_moves_it(folders, path, moves):
    for folder in folders:
        before = source_in(folder)
        assert (source_in(folder, path) != before) == moves
