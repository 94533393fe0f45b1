"""Errors that survive being re-raised: every class takes ``*args`` only.

SimPy re-creates a failed process's exception as ``type(e)(*e.args)``; a keyword-only or derived
argument would be lost on the way, so each message is built where it is raised.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager


class DesimError(Exception):
    """Root of all errors that desim raises on purpose."""


class InputError(DesimError):
    """The user's input is wrong. ``args`` are the complaints, one line each; exit code 2.

    A line may begin with the path of what is wrong in the scenario: ``fleet.start: ...``. A plug-in
    does not know where it stands: its paths begin with a dot, ``.ports.q: ...``, and ``below``
    completes them.
    """

    def __str__(self) -> str:
        return "\n".join(str(line) for line in self.args)


@contextmanager
def extra(name: str, what: str) -> Iterator[None]:
    """For imports: raises ``InputError`` that names the extra ``name`` where a package of it is not
    installed, and ``what`` needs it."""
    try:
        yield
    except ModuleNotFoundError as error:
        package = str(error.name).partition(".")[0]
        raise InputError(f"{what}: {package} is not installed; "
                         f"pip install 'desim[{name}]'") from error


def unwritable(place: object, error: OSError) -> InputError:
    """A file or folder that cannot be written, and the system's reason."""
    return InputError(f"{place} cannot be written: {error.strerror or error}")


class KernelError(DesimError):
    """Clock or agenda were misused: a float delay, a time in the past, an endless instant."""


class ModelError(DesimError):
    """A plug-in broke its contract: settled a frame twice, dropped for an undeclared reason, ..."""


@contextmanager
def below(path: str) -> Iterator[None]:
    """Complete the paths of complaints inside: they are about ``path`` of the scenario, or below it
    where a line says so: ``.ports.q: ...`` becomes ``network.media.lan.ports.q: ...``."""
    try:
        yield
    except InputError as error:
        raise InputError(*(f"{path}{line}" if line.startswith(".") else f"{path}: {line}"
                           for line in map(str, error.args))) from error


def first_line(error: BaseException) -> str:
    """The first line of somebody else's error; its type where it has none."""
    return str(error).strip().partition("\n")[0].rstrip() or type(error).__name__


def described(error: BaseException) -> str:
    """``ValueError: ...``: type and first line of somebody else's error. What sys.exit() was called
    with is a message only if it is a text or a number."""
    if isinstance(error, SystemExit) and not isinstance(error.code, str | int):
        return "SystemExit: sys.exit() was called"
    kind, line = type(error).__name__, first_line(error)
    return kind if line == kind else f"{kind}: {line}{_meant(error)}"


def _meant(error: BaseException) -> str:
    """The attribute that was meant where there is none of that name, as Python's tracebacks have
    it."""
    if not isinstance(error, AttributeError) or not error.name or error.obj is None:
        return ""
    try:
        known = [name for name in dir(error.obj) if not name.startswith("_")]
    except Exception:  # somebody else's __dir__
        return ""
    return did_you_mean(error.name, known)


def printable(text: str) -> str:
    """Somebody else's text, without anything that a terminal would take for commands."""
    if text.isprintable():
        return text
    return "".join(letter if letter.isprintable() or letter == "\n" else repr(letter)[1:-1]
                   for letter in text)


def did_you_mean(word: str, known: Iterable[str]) -> str:
    """`` (did you mean 'rate'?)`` for the nearest of ``known``, or an empty string."""
    import difflib

    near = difflib.get_close_matches(word, list(known), n=1, cutoff=0.6)
    return f" (did you mean {near[0]!r}?)" if near else ""


def host_index(key: str, name: str, hosts: Sequence[str]) -> int:
    """The index of the host that the parameter ``key`` of a plug-in names. Raises ``InputError``
    unless it is one of ``hosts``."""
    if name not in hosts:
        raise InputError(f".{key}: no host {name!r}{did_you_mean(name, hosts)}; allowed: "
                         f"{', '.join(hosts)}")
    return hosts.index(name)


def class_of(plugin: object) -> str:
    """The class of a plug-in, or the function that it wraps, and where it stands:
    ``bad.Model (bad.py:7)``."""
    import inspect

    return place_of(inspect.unwrap(type(plugin)))


def method_of(plugin: object, name: str) -> str:
    """A method of a plug-in and where it stands: ``bad.Model.send (bad.py:9)``."""
    import inspect

    method = inspect.unwrap(getattr(plugin, name))
    return place_of(method) if hasattr(method, "__qualname__") else class_of(plugin)


def place_of(code: Callable[..., object]) -> str:
    """A class or function and where it stands: ``bad.Model (bad.py:7)``."""
    import inspect
    from pathlib import Path

    name = f"{code.__module__}.{code.__qualname__}"
    try:
        return f"{name} ({Path(inspect.getfile(code)).name}:{inspect.getsourcelines(code)[1]})"
    except (OSError, TypeError):  # it was made up by a program
        return name
