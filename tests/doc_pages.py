"""Pages with programs in them: their files, and their commands with what these print.

A block of code whose first line is ``# name.ext`` is a file. A block ``console`` has commands, each
a line that begins with ``$``, and lines that they print, in this order; ``...`` stands for others.
"""

import re
import shlex
import subprocess
import sys
from collections.abc import Iterator
from contextlib import chdir
from glob import glob
from pathlib import Path
from unittest.mock import patch

from typer.testing import CliRunner

from desim.cli import app


def blocks(page: Path) -> Iterator[tuple[str, str]]:
    """Language and text of each block of code."""
    for found in re.finditer(r"^```(\w+)\n(.*?)^```$", page.read_text(), re.M | re.S):
        yield found[1], found[2]


def written(page: Path, folder: Path) -> list[str]:
    """Write the page's files into ``folder``; their names."""
    names = []
    for _, text in blocks(page):
        named = re.match(r"# ([\w.]+\.(?:py|yaml))\n", text)
        if named:
            (folder / named[1]).write_text(text)
            names.append(named[1])
    return names


def commands(page: Path) -> Iterator[tuple[str, list[str]]]:
    """Each command of the page, and the lines that stand below it."""
    for language, text in blocks(page):
        if language != "console":
            continue
        for part in re.split(r"^\$ ", text.replace("\\\n", " "), flags=re.M)[1:]:
            command, *lines = part.splitlines()
            yield command, [line for line in lines if line.strip()]


def printed(command: str, folder: Path) -> str:
    """The output of a command of the page, run in ``folder``; those of desim in this process."""
    program, *words = [name for word in shlex.split(command) for name in (
        sorted(glob(word, root_dir=folder)) if "*" in word else [word])]
    if program == "desim":
        with chdir(folder), patch.object(sys, "path", [*sys.path]):
            done = CliRunner(env={"COLUMNS": "100", "TERM": "dumb"}).invoke(app, words)
        code, output = done.exit_code, done.output
    else:
        assert program == "python"
        ended = subprocess.run([sys.executable, *words], cwd=folder, text=True, check=False,
                               stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
        code, output = ended.returncode, ended.stdout
    assert code == 0, f"{command}\n{output}"
    return output


def assert_as_shown(shown: list[str], output: str) -> None:
    """The lines of a page are among those of the output, in their order."""
    lines = iter([" ".join(line.split()) for line in output.splitlines()])
    for line in shown:
        wanted = " ".join(line.split())
        assert wanted == "..." or wanted in lines, f"{line!r} is not (there) in\n{output}"
