"""The tables of docs/ below ``<!-- printed -->`` are what the page's scripts print.

A page names its scripts as commands, ``python scenarios/.../NAME.py results/CAMPAIGN ...``. Here
``results/`` is docs/studies/, with the runs that are committed. Each line of such a table is one of
the script's lines, letter for letter, in its order: a page may leave rows out.
"""

import re
import runpy
import shutil
import sys
from contextlib import chdir
from pathlib import Path

import matplotlib.figure
import pytest

COMMAND = re.compile(r"python (scenarios/\w+/\w+\.py) ([^`\n]*)")
DOCS = Path(__file__).parents[2] / "docs"


def commands(page):
    """The script and the arguments of each command whose runs are committed."""
    found = ((script, arguments.split()) for script, arguments in COMMAND.findall(page))
    return [(script, arguments) for script, arguments in found
            if (DOCS / "studies" / arguments[0].removeprefix("results/")).is_dir()]


PAGES = sorted(page.relative_to(DOCS).as_posix() for page in DOCS.rglob("*.md")
               if commands(page.read_text()))


def tables(page):
    """The lines of each table that a script prints."""
    return [table.splitlines() for table in re.findall(r"<!-- printed -->\n((?:\|.*\n)+)", page)]


def is_among(table, printed):
    lines = iter(printed)
    return all(line in lines for line in table)


@pytest.fixture
def printed(repository, tmp_path, capsys, monkeypatch):
    """A function that runs a command beside the committed runs: the lines that it prints."""
    for runs in (DOCS / "studies").glob("*/runs.parquet"):
        for place in ("results", "docs/studies"):
            (tmp_path / place / runs.parent.name).mkdir(parents=True)
            shutil.copy(runs, tmp_path / place / runs.parent.name)
    monkeypatch.setattr(matplotlib.figure.Figure, "savefig", lambda *_, **__: None)

    def run(script, arguments):
        with monkeypatch.context() as here, chdir(tmp_path):
            here.setattr(sys, "argv", [script, *arguments])
            here.syspath_prepend(str((repository / script).parent))
            runpy.run_path(str(repository / script), run_name="__main__")
        return capsys.readouterr().out.splitlines()
    return run


@pytest.mark.parametrize("name", PAGES)
def test_a_page_has_the_tables_that_its_scripts_print(name, printed):
    page = (DOCS / name).read_text()
    outputs = [printed(*command) for command in commands(page)]
    wrong = ["\n".join(table) for table in tables(page)
             if not any(is_among(table, output) for output in outputs)]
    assert not wrong, "\n\n".join(wrong)
    for command, output in zip(commands(page), outputs, strict=True):
        assert any(is_among(table, output) for table in tables(page)), f"{command}: no table"


def test_a_changed_figure_is_found(printed):
    """Any figure of any table of the page, and a row in another place."""
    page = (DOCS / "studies/computers.md").read_text()
    output = [line for command in commands(page) for line in printed(*command)]
    for table in tables(page):
        for number, line in enumerate(table):
            for figure in re.finditer(r"\d", line):
                other = str((int(figure[0]) + 1) % 10)
                wrong = line[:figure.start()] + other + line[figure.end():]
                assert not is_among([*table[:number], wrong, *table[number + 1:]], output)
        assert not is_among([*table[:2], *table[:1:-1]], output)
