"""The pages of docs/ name files that exist, and link to pages and headings that exist."""

import importlib
import re

import pytest

from desim.plugins import GROUPS

PAGES = ["README.md", "CONTRIBUTING.md", "CHANGELOG.md"]
FOLDERS = ("desim/", "netmodels/", "tools/", "tests/", "scenarios/", "docs/")
NOT_PYTHON = {*GROUPS.values(), "desim.raised"}  # groups of entry points, a key of metadata


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
    wrong = []
    for page in pages(repository):
        for name in re.findall(r"`([\w./-]+\.(?:py|yaml|md|csv|sh))`", prose(page)):
            if name.startswith(FOLDERS) and not (repository / name).exists():
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


@pytest.mark.parametrize("name, words", [("architecture.md", 600)])
def test_a_page_that_is_read_first_is_short(repository, name, words):
    assert len((repository / "docs" / name).read_text().split()) <= words
