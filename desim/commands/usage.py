"""The message about a wrong command line, in one line."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from functools import partial

import typer
from typer.core import TyperGroup

from desim.commands.exit_codes import TRACEBACK
from desim.commands.output import say

# The base of all such errors, of click or of typer's own copy of it. mypy takes any base for
# ``type | None``; this one has all of a ``BadParameter`` that is used here.
_UsageError: type[typer.BadParameter] = typer.BadParameter.__base__  # type: ignore[assignment]


class Commands(TyperGroup):
    """The commands. A wrong command line gets one line, not typer's box, and exit code 2."""

    def main(self, args: Sequence[str] | None = None, prog_name: str | None = None,
             complete_var: str | None = None, standalone_mode: bool = True,
             windows_expand_args: bool = True, **extra: object) -> object:
        words = [word for word in (sys.argv[1:] if args is None else args) if word != TRACEBACK]
        run = partial(super().main, words, prog_name, complete_var, standalone_mode=False,
                      windows_expand_args=windows_expand_args, **extra)
        if not standalone_mode:
            return run()
        try:
            code = run()
        except _UsageError as error:
            _explain(error)
            code = error.exit_code
        sys.exit(code or 0)


def _explain(error: typer.BadParameter) -> None:
    """Print a line, but for an error that has shown the help itself."""
    context, wrong = error.ctx, error.format_message()
    if wrong:
        words = [] if context is None else context.command_path.split()[1:]
        command = " ".join(["desim", *words])
        say(f"{wrong.rstrip('.')}; allowed: see {command} --help", err=True)
