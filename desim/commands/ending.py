"""How a command begins and ends: exit codes, and what is compiled on the way."""

from __future__ import annotations

import shlex
import signal
import sys
import time
import traceback
from collections.abc import Iterator
from contextlib import contextmanager

import typer

from desim.engine.address_space import refuse_small
from desim.errors import InputError, printable

TRACEBACK = "--traceback"


@contextmanager
def exits() -> Iterator[None]:
    """2 for wrong input, 130 for Ctrl-C, 1 for a failure with the way to repeat it, and with its
    traceback where the fault is ours or ``--traceback`` was given."""
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
        if not found.stranger or TRACEBACK in sys.argv:
            say(traceback.format_exc().rstrip(), err=True)
        say(f"{found.line}\nthis repeats it:\n  {command_line()}" if found.stranger
            else f"desim failed; this repeats it:\n  {command_line()}", err=True)
        raise typer.Exit(1) from None


def say(text: str, err: bool = False) -> None:
    """A line, or several, on the terminal; what somebody else wrote is text there."""
    typer.echo(printable(text), err=err)


@contextmanager
def ended_in_order() -> Iterator[None]:
    """A termination signal is as good as Ctrl-C: a batch system's time limit, a shutdown."""
    before = signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)


def command_line() -> str:
    return shlex.join(["desim", *sys.argv[1:]])


@contextmanager
def compiling_inside(quiet: bool) -> Iterator[None]:
    """Around a simulation that may import kernels of its own while it is built, as a radio does:
    says so where some have to be compiled, which takes half a minute."""
    from desim.engine.compiled import announced

    with announced(lambda: None if quiet else say(
            "compiling numerical kernels (first run with these models only)...", err=True)):
        yield


@contextmanager
def compiling(quiet: bool) -> Iterator[None]:
    """Around the first import of kernels: says so where some have to be compiled."""
    from desim.engine.compiled import announced

    begin_s = None

    def told() -> None:
        nonlocal begin_s
        begin_s = time.perf_counter()
        if not quiet:
            say("compiling numerical kernels (first run only)...", err=True)

    try:
        with announced(told):
            yield
    except RuntimeError as error:
        if "cannot cache function" not in str(error):
            raise
        raise InputError("compiled kernels can be kept neither beside desim nor in the home "
                         "folder; set NUMBA_CACHE_DIR to a folder that can be written") from error
    if begin_s is not None and not quiet:
        say(f"compiled in {time.perf_counter() - begin_s:.1f} s", err=True)
