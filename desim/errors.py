"""Errors that survive being re-raised: every class takes ``*args`` only.

SimPy re-creates a failed process's exception as ``type(e)(*e.args)``; a keyword-only or derived
argument would be lost on the way, so messages are built by whoever raises.
"""

from __future__ import annotations


class DesimError(Exception):
    """Root of all errors that desim raises on purpose."""


class InputError(DesimError):
    """The user's input is wrong. ``args`` are the complaints, one line each; exit code 2."""

    def __str__(self) -> str:
        return "\n".join(str(line) for line in self.args)


class KernelError(DesimError):
    """Clock or agenda were misused: a float delay, a time in the past, an endless instant."""


class ModelError(DesimError):
    """A plug-in broke its contract: settled a frame twice, dropped for an undeclared reason, ..."""


def did_you_mean(word: str, known) -> str:
    """`` (did you mean 'rate'?)`` for the nearest of ``known``, or an empty string."""
    import difflib

    near = difflib.get_close_matches(word, list(known), n=1, cutoff=0.6)
    return f" (did you mean {near[0]!r}?)" if near else ""
