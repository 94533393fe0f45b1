"""A run's name moves with the code that makes it, wherever that is installed."""

import os
import shutil
import subprocess
import sys

import pytest
from packages import LAYERS

from desim.results import identity
from desim.scenario.load import load
from desim.scenario.schema.communication import PluginChoice

ASK = "from desim.results.identity import source; print(source(()))"


def source_in(folder, path=""):
    """The hash of the source of the copy of desim in ``folder``, after a change of ``path``."""
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


@pytest.mark.parametrize("path, moves", [("engine/kernel.py", True),
                                         ("computers/costs/measured.py", True),
                                         ("campaign/design/plan.py", False)])
def test_a_change_of_what_computes_moves_it(folders, path, moves):
    """In the folder whose names could be taken for those of packages."""
    _, below = folders
    before = source_in(below)
    assert (source_in(below, path) != before) == moves


def test_every_layer_of_a_run_is_hashed():
    """Pictures, campaigns' statistics, XML and what differs between operating systems have no part
    in a run."""
    of_a_run = {*LAYERS[:LAYERS.index("results") + 1]} - {"colours", "statistics", "outside_xml",
                                                          "operating_system"}
    assert {name.removesuffix(".py") for name in identity._COMPUTES} == of_a_run


# Prints the name of the run of ``s.yaml`` after a change of each of these files by itself.
NAMED = """\
import os, sys, desim
from pathlib import Path
from desim.results.identity import Identity
for file in map(Path, sys.argv[1:]):
    text = file.read_text()
    file.write_text(text + "\\nCHANGED = 1\\n")
    if not os.fork():
        print(Identity(desim.load("s.yaml").scenario).run_id(1), flush=True)
        os._exit(0)
    os.wait()
    file.write_text(text)
"""
OWN = {
    "s.yaml": "name: s\ncoordination: {strategy: 'mine:Mine'}\nstop: {when: 'ends:late'}\n",
    "mine.py": "from base import Mine\n",
    "base.py": "from desim.ports import Params\n\n\nclass Mine:\n    class Params(Params):\n"
               "        pass\n\n    def __init__(self, params):\n        pass\n\n"
               "    def choose(self, view):\n        from picked.first import pick\n"
               "        return pick(view.frontiers())\n",
    "broken.py": "print 'of another Python'\n",
    "picked/__init__.py": "",
    "picked/first.py": "def pick(frontiers):\n    return frontiers[0]\n",
    "ends.py": "import limit\ntry:\n    import broken\nexcept SyntaxError:\n    pass\n\n\n"
               "def late(quantities):\n    return False\n",
    "limit.py": "",
    "other.py": "",
    "notes.txt": "",
}


def test_what_a_users_module_imports_from_its_folder_moves_it(tmp_path):
    for name, text in OWN.items():
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(text)
    names = [name for name in OWN if name != "s.yaml"]
    found = subprocess.run([sys.executable, "-c", NAMED, *names], cwd=tmp_path, check=True,
                           text=True, capture_output=True)
    ids = dict(zip(names, found.stdout.split(), strict=True))
    assert ids.pop("other.py") == ids["notes.txt"]
    assert len(set(ids.values())) == len(ids)


@pytest.mark.parametrize("function", ["math:isfinite", "shutil:which", "sys:exit"])
def test_a_function_that_was_installed_stands_by_itself(tmp_path, function):
    """``shutil`` imports its neighbours, the others have no source."""
    (tmp_path / "plain.yaml").write_text("name: s\n")
    (tmp_path / "ends.yaml").write_text(f"name: s\nstop: {{when: '{function}'}}\n")
    plain, ends = (len(identity._files(identity.modules(
        load(tmp_path / f"{name}.yaml").scenario))) for name in ("plain", "ends"))
    assert ends - plain <= 2  # where it is named, and where it is defined


def test_every_kind_of_plug_in_that_a_scenario_chooses_is_part_of_the_name(tmp_path):
    (tmp_path / "s.yaml").write_text(
        "name: s\ncoordination: {exchange: {content: full}}\n"
        "network: {media: {lan: {model: ideal, rules: [{rule: loss, probability: 1 %}]}}}\n")

    def kinds(choice):
        own = {choice.kind} if "kind" in vars(choice) else set()
        return own.union(*map(kinds, choice.__subclasses__()))

    named = {name.partition(" ")[0]
             for name in identity.plugin_references(load(tmp_path / "s.yaml").scenario)}
    assert named == kinds(PluginChoice) | {"world"}
