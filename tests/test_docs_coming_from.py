"""docs/coming-from-*.md: the commands that they show are taken, and the settings that they name."""

import re
import shlex

import pytest
from typer.testing import CliRunner

from desim.cli import app
from desim.scenario.load import load

PAGES = ("ros", "ns-3", "gazebo", "irsim")
SETTING = re.compile(r"`((?:robot|middleware|coordination|computers|faults)[\w.]*): ?([^`]+)`")


@pytest.fixture
def hello(repository, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "hello.yaml").write_text((repository / "scenarios" / "hello.yaml").read_text())


@pytest.mark.parametrize("page", PAGES)
def test_its_commands_are_taken(page, repository, hello):
    """They run nothing here: a sweep is foreseen, and of a run the scenario is loaded."""
    text = (repository / "docs" / f"coming-from-{page}.md").read_text()
    assert text.splitlines()[0].endswith("?")
    commands = [shlex.split(line) for block in re.findall(r"```sh\n(.*?)```", text, re.DOTALL)
                for line in block.splitlines()]
    assert commands
    for _, command, *words in commands:
        if command == "run":
            assert load("hello.yaml", [after for before, after in zip(words, words[1:],
                                       strict=False) if before == "--set"])
        taken = CliRunner().invoke(app, [command, "--help"] if command != "sweep" else [
            command, *words, "--dry-run", "--until", "10 ms"])
        assert taken.exit_code == 0, taken.output


def test_its_settings_are_keys(repository, hello):
    text = (repository / "docs" / "coming-from-ros.md").read_text()
    settings = [f"{key}={value}" for key, value in SETTING.findall(text)]
    assert len(settings) >= 7
    for setting in settings:
        assert load("hello.yaml", [setting])
