"""The plug-ins in docs/writing-plugins.md run, and their commands print what stands there."""

import shutil

import pytest
import regolden  # a tool
from doc_pages import assert_as_shown, blocks, commands, printed, written


@pytest.fixture(scope="module")
def page(repository):
    return repository / "docs" / "writing-plugins.md"


@pytest.fixture(scope="module")
def folder(repository, page, tmp_path_factory):
    folder = tmp_path_factory.mktemp("mine")
    shutil.copy(repository / "scenarios" / "hello.yaml", folder)
    written(page, folder)
    return folder


def test_a_rule_is_complete_in_17_lines(page):
    rule, = (text for _, text in blocks(page) if "class Fence" in text)
    assert len([line for line in rule.splitlines()[1:] if line.strip()]) <= 17


def test_each_command_prints_what_the_page_shows(page, folder):
    played = []
    for command, shown in commands(page):
        output = printed(command, folder)
        played.append(command)
        if not regolden.elsewhere():
            assert_as_shown(shown, output)
    assert {"desim run fenced.yaml", "desim run orbit.yaml", "desim run spreading.yaml",
            "desim run muddy.yaml", "desim run rooms.yaml", "python test_mine.py"} <= set(played)
