"""What is wrong with a command line, in one line."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from typing import Any

import typer
from typer.core import TyperGroup

from desim.commands.ending import TRACEBACK, say

_UsageError = typer.BadParameter.__base__  # of click, or of what typer has taken from it


class Commands(TyperGroup):
    """The commands. What typer would draw a box around takes a line here; exit code 2."""

    def main(self, args: Sequence[str] | None = None, *more: Any, standalone_mode: bool = True,
             **extra: Any) -> Any:
        words = [word for word in (sys.argv[1:] if args is None else args) if word != TRACEBACK]
        if not standalone_mode:
            return super().main(words, *more, standalone_mode=False, **extra)
        try:
            code = super().main(words, *more, standalone_mode=False, **extra)
        except _UsageError as error:
            _tell(error)
            code = error.exit_code
        sys.exit(code or 0)


def _tell(error: Any) -> None:
    """Nothing where it has shown the help itself."""
    context, wrong = error.ctx, error.format_message()
    if wrong:
        command = "desim" if context.parent is None else f"desim {context.info_name}"
        say(f"{wrong.rstrip('.')}; allowed: see {command} --help", err=True)
