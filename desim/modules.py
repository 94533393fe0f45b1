"""Modules of plug-ins: found beside a file, or where Python finds them, and imported."""

from __future__ import annotations

import importlib
import os
import sys
from traceback import walk_tb
from types import ModuleType

from desim.errors import first_line


def why(error: BaseException, place: str) -> str:
    """The reason why a module could not be imported, with its line of a user's file."""
    if isinstance(error, SyntaxError):
        return f"{error.msg} at {os.path.basename(error.filename or '')}:{error.lineno}"
    reason = first_line(error) if isinstance(error, Exception) else repr(error)
    if isinstance(error, ModuleNotFoundError) and f"{place}.".startswith(f"{error.name}."):
        return (f"{reason}; looked beside the file that names it, where Python finds modules, and "
                "in the current directory")
    file = source_of(os.path.abspath(place)) or ""
    lines = [line for frame, line in walk_tb(error.__traceback__)
             if frame.f_code.co_filename == file]
    return f"{reason} at {os.path.basename(file)}:{lines[-1]}" if lines else reason


def module_at(folder: str, name: str) -> ModuleType:
    """The module ``name``, imported; without a folder, modules are also looked for in the current
    directory. It may fail as a user's module may."""
    place = os.path.abspath(folder)  # of "": the current directory
    if place not in sys.path:
        sys.path.append(place)  # at the end: it shadows nothing
    if not folder:
        return importlib.import_module(name)
    sys.path.insert(0, place)
    try:
        module = importlib.import_module(name)
    finally:
        sys.path.remove(place)
    meant = source_of(os.path.join(place, name))
    if meant and os.path.realpath(module.__file__ or "") != os.path.realpath(meant):
        raise ImportError(f"another module {name!r} is in use already, from {module.__file__}; "
                          "rename one of them")
    return module


def source_of(place: str) -> str | None:
    """The source of the module ``folder/package.module``, None if there is none."""
    folder, module = os.path.split(place)
    stem = os.path.join(folder, *module.split("."))
    files = (f"{stem}.py", os.path.join(stem, "__init__.py"))
    return next((file for file in files if os.path.isfile(file)), None)
