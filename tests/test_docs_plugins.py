"""The plug-ins in docs/writing-plugins.md run, and their commands print what stands there."""

import os
import shutil
import subprocess
import sys

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


def test_an_auction_is_complete_in_60_lines(page):
    auction, = (text for _, text in blocks(page) if "class Auction" in text)
    assert len(auction.splitlines()[1:]) <= 60


def test_a_localization_is_complete_in_30_lines(page):
    upright, = (text for _, text in blocks(page) if "class Upright" in text)
    assert len([line for line in upright.splitlines()[1:] if line.strip()]) <= 30


def test_each_command_prints_what_the_page_shows(page, folder):
    played = []
    for command, shown in commands(page):
        output = printed(command, folder)
        played.append(command)
        if not regolden.elsewhere():
            assert_as_shown(shown, output)
    assert {"desim run fenced.yaml", "desim run orbit.yaml", "desim run spreading.yaml",
            "desim run auctioning.yaml", "desim run sharing.yaml",
            "desim run rallying.yaml", "desim run upright.yaml",
            "desim run muddy.yaml", "desim run rooms.yaml",
            "python test_mine.py"} <= set(played)


def type_errors(repository, folder):
    """The complaints of mypy about the page's plug-ins beside the contracts."""
    done = subprocess.run(
        [sys.executable, "-m", "mypy", "--follow-imports=silent", "--ignore-missing-imports",
         "test_mine.py"], cwd=folder, env={**os.environ, "MYPYPATH": str(repository)}, text=True,
        capture_output=True, check=False)
    return [line for line in done.stdout.splitlines() if ": error:" in line]


def test_a_type_checker_holds_plug_ins_against_their_contracts(repository, folder, tmp_path):
    pytest.importorskip("mypy")
    shutil.copytree(folder, tmp_path, dirs_exist_ok=True, ignore=lambda *_: ["results"])
    assert not type_errors(repository, tmp_path)
    fence = tmp_path / "fence.py"
    fence.write_text(fence.read_text().replace("def judge(", "def judges("))
    assert type_errors(repository, tmp_path)
