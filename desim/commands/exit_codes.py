"""The exit code of a command.

0: done. 1: a run or a model failed, or a check does not hold (the command then raises
``typer.Exit(1)`` itself). 2: wrong input (``InputError``, or a command line that typer refuses:
``usage.py``). 130: interrupted. Code 1 is also that of a closed pipe.
"""

from __future__ import annotations

import shlex
import signal
import sys
import traceback
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext

import typer

from desim.commands.output import say
from desim.errors import InputError, described
from desim.operating_system.address_space import refuse_small

TRACEBACK = "--traceback"
# What code meets where a table has other columns, or a number is a text. Arrow's are of these.
_STRANGE = (LookupError, TypeError, ValueError, AttributeError, ArithmeticError)


@contextmanager
def exit_codes() -> Iterator[None]:
    """Turn an error into an exit code and a message: 2 for wrong input, 130 for Ctrl-C, 1 for a
    failure, with the command that repeats it, and with its traceback where the fault is desim's or
    ``--traceback`` was given."""
    try:
        refuse_small()
        yield
    except typer.Exit:
        raise
    except InputError as error:
        say(str(error), err=True)
        raise typer.Exit(2) from None
    except KeyboardInterrupt as stopped:
        kept = f"; what there is until then: {stopped}" if str(stopped) else ""
        say(f"interrupted{kept}", err=True)
        raise typer.Exit(130) from None
    except BrokenPipeError:
        raise typer.Exit(1) from None
    except Exception as error:
        from desim.blame import blame

        found = blame(error)
        if not found.foreign or TRACEBACK in sys.argv:
            say(traceback.format_exc().rstrip(), err=True)
        say(f"{found.line}\nthis repeats it:\n  {command_line()}" if found.foreign
            else f"desim failed; this repeats it:\n  {command_line()}", err=True)
        raise typer.Exit(1) from None


@contextmanager
def reading(trust: bool = False) -> Iterator[None]:
    """``exit_codes`` of a command that reads folders of results, which somebody else may have made:
    unless they are to be trusted, no code runs that is not installed, and what does not fit
    together in their content is wrong input."""
    with exit_codes():
        from desim import plugins
        from desim.blame import blame

        try:
            with nullcontext() if trust else plugins.installed_only():
                yield
        except _STRANGE as error:
            if blame(error).foreign or TRACEBACK in sys.argv:
                raise
            raise InputError("a file of the folder has other content than desim writes, although "
                             f"its digest is right: {described(error)}; --traceback shows where"
                             ) from error


@contextmanager
def terminable() -> Iterator[None]:
    """Treat a termination signal as Ctrl-C: a batch system's time limit, a shutdown."""
    before = signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)


def command_line() -> str:
    """The command as it was typed, but for the program's path."""
    return shlex.join(["desim", *sys.argv[1:]])
