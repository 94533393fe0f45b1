"""The pages of docs/ name files that exist, and link to pages and headings that exist."""

import ast
import importlib
import re
from pathlib import Path

import pytest
from packages import LAYERS

from desim.cli import app
from desim.monitor.tasks.delivery import Deliveries
from desim.monitor.tasks.journeys import ManyJourneys
from desim.monitor.tasks.patrolling import Patrolling
from desim.plugins import GROUPS
from desim.scenario.schema.experiment import ENERGY, OF_COMPUTERS, QUANTITIES

PAGES = ["README.md", "CONTRIBUTING.md", "CHANGELOG.md"]
FOLDERS = ("desim/", "netmodels/", "tools/", "tests/", "scenarios/", "docs/")
# Groups of entry points, a key of metadata, a name of the past in the changelog.
NOT_PYTHON = {*GROUPS.values(), "desim.raised", "desim.reference",
              "netmodels.radio.Radio"}


def pages(repository):
    return [repository / name for name in PAGES if (repository / name).exists()] + sorted(
        (repository / "docs").rglob("*.md"))


def prose(page):
    return re.sub(r"^```.*?^```", "", page.read_text(), flags=re.S | re.M)


def anchors(page):
    """The names that GitHub gives the headings."""
    return {re.sub(r"[^\w\- ]", "", title.lower()).strip().replace(" ", "-")
            for title in re.findall(r"^#+ (.+)$", prose(page), re.M)}


def test_links_lead_somewhere(repository):
    wrong = []
    for page in pages(repository):
        for link in re.findall(r"\]\(([^)\s]+)\)", prose(page)):
            path, _, anchor = link.partition("#")
            if "://" in path:
                continue
            target = (page.parent / path) if path else page
            if not target.exists() or anchor and anchor not in anchors(target):
                wrong.append(f"{page.name}: {link}")
    assert not wrong


def test_files_that_are_named_exist(repository):
    modules = {"setup.py", *(file.name for folder in FOLDERS
                             for file in (repository / folder).rglob("*.py"))}
    written = {"nth.py", "look.py"}  # by the tutorial
    wrong = []
    for page in pages(repository):
        for name in re.findall(r"`([\w./-]+\.(?:py|yaml|md|csv|sh))`", prose(page)):
            if name.startswith(FOLDERS) and not (repository / name).exists():
                wrong.append(f"{page.name}: {name}")
            bare = name.rpartition("/")[2]
            if bare.endswith(".py") and bare not in modules | written:
                wrong.append(f"{page.name}: {name}")
    assert not wrong


def resolved(name):
    """The module or attribute of this dotted name; None where there is no such thing."""
    module, _, attribute = name.rpartition(".")
    try:
        return importlib.import_module(name)
    except ImportError:
        return getattr(resolved(module), attribute, None) if module else None


def test_names_of_python_exist(repository):
    wrong = []
    for page in pages(repository):
        for name in re.findall(r"`((?:desim|netmodels)(?:\.\w+)+)(?:\(.*?\))?`", prose(page)):
            if name not in NOT_PYTHON and resolved(name) is None:
                wrong.append(f"{page.name}: {name}")
    assert not wrong


def test_the_walks_of_the_architecture_are_of_files_that_exist(repository):
    """There, paths are relative to desim/, and a bare name is beside the last one named."""
    text = prose(repository / "docs" / "architecture.md")
    folder = repository / "desim"
    for name in re.findall(r"`([\w/]+\.py)`", text):
        places = [root / name for root in (repository / "desim", repository, folder)]
        found = next((place for place in places if place.is_file()), None)
        assert found, name
        folder = found.parent


def test_the_story_of_the_architecture_is_the_one_that_is_enforced(repository):
    text = (repository / "docs" / "architecture.md").read_text()
    layers = next(part for part in text.split("\n\n") if part.startswith("units, errors"))
    assert re.findall(r"\w+", layers) == LAYERS


def test_the_page_of_scenarios_has_all_quantities_of_expressions(repository):
    rows = (repository / "docs" / "scenarios.md").read_text().partition("| quantity | |\n")[2]
    names = [name for line in rows.partition("\n\n")[0].splitlines()
             for name in re.findall(r"`(\w+)`", line.split("|")[1])]
    assert sorted(names) == sorted((*QUANTITIES, ENERGY, *OF_COMPUTERS,
                                    *Deliveries.traits.quantities, *ManyJourneys.traits.quantities,
                                    *Patrolling.traits.quantities))


def names_in(file):
    """The top-level names of a module, and the members of its classes with a dot."""
    found = set()
    for node in ast.parse(file.read_text()).body:
        if isinstance(node, ast.FunctionDef | ast.ClassDef):
            found.add(node.name)
        if isinstance(node, ast.ClassDef):
            found |= {f"{node.name}.{member.name}" for member in node.body
                      if isinstance(member, ast.FunctionDef)}
        if isinstance(node, ast.Assign):
            found |= {part.id for target in node.targets for part in ast.walk(target)
                      if isinstance(part, ast.Name)}
    return found


def test_what_where_is_names_is_there(repository):
    rows = [re.findall(r"`([\w./]+)`", "|".join(line.split("|")[2:]))
            for line in (repository / "docs" / "where-is.md").read_text().splitlines()
            if line.startswith("| ") and "`" in line]
    assert len(rows) > 30
    wrong = []
    for row in rows:
        files = [repository / ("" if name.startswith("netmodels/") else "desim") / name
                 for name in row if name.endswith(".py")]
        there = set().union(*map(names_in, files))
        wrong += [f"{row[0]}: {name}" for name in row
                  if not name.endswith(".py") and name not in there]
    assert not wrong


def test_the_page_of_commands_has_all_and_says_which_end_with_1_for_an_outcome(repository):
    rows = [line.split("|") for line in (repository / "docs" / "commands.md").read_text()
            .splitlines() if line.startswith("| `desim")]
    fails = {row[1].strip(" `").removeprefix("desim "): bool(row[3].strip()) for row in rows}
    functions = {node.name.rstrip("_"): node
                 for file in (repository / "desim" / "commands").glob("*.py")
                 for node in ast.parse(file.read_text()).body if isinstance(node, ast.FunctionDef)}
    commands = [*(command.callback.__name__.rstrip("_") for command in app.registered_commands),
                *(group.name for group in app.registered_groups)]
    assert fails == {name: "typer.Exit(1)" in ast.unparse(functions[name]) for name in commands}


@pytest.mark.parametrize("name, words", [("architecture.md", 600)])
def test_a_page_that_is_read_first_is_short(repository, name, words):
    assert len((repository / "docs" / name).read_text().split()) <= words


def not_in_the_index(repository, index):
    """Pages and tables of studies that the index does not link to, and designs that it does not
    name."""
    folder, scenarios = repository / "docs" / "studies", repository / "scenarios"
    linked = {(folder / link).resolve() for link in re.findall(r"\]\(([^)#]+)", index)}
    files = {*folder.glob("*.md"), *folder.glob("*/runs.parquet")} - {folder / "README.md"}
    designs = {file.relative_to(scenarios).as_posix().removeprefix("studies/")
               for place in ("studies", "paper") for file in (scenarios / place).glob("*.yaml")
               if not file.stem.endswith("_small")}
    return sorted(map(str, {file.resolve() for file in files} - linked)) + sorted(
        designs - set(re.findall(r"`([\w/]+\.yaml)`", index)))


def test_every_study_is_in_the_index(repository):
    index = (repository / "docs" / "studies" / "README.md").read_text()
    assert not not_in_the_index(repository, index)
    assert [Path(missing).name for missing in not_in_the_index(repository, (
        index.replace("](ladder.md)", "](gone.md)").replace("`doors.yaml`", "").replace(
            "(range/runs.parquet)", "()")))] == ["ladder.md", "runs.parquet", "doors.yaml"]
