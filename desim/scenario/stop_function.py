"""A condition to stop at that is a Python function of the user's."""

from __future__ import annotations

import reprlib
from collections.abc import Callable, Mapping
from inspect import signature
from pathlib import Path
from traceback import walk_tb
from typing import NoReturn

from desim import plugins
from desim.errors import InputError, ModelError, described, place_of


class StopFunction:
    """The function at ``package.module:name``, perhaps with its folder in front, which gets a
    mapping of the quantities. Raises ``InputError`` if there is none, or if it takes something
    else. A call returns bool() of its answer, and raises ``ModelError`` that says what went wrong
    where."""

    def __init__(self, path: str) -> None:
        self.name = plugins.bare(path)
        self._function = plugins.imported("function", path)
        if not callable(self._function):
            raise InputError(f"{self.name!r} is not a function")
        if not _takes_one(self._function):
            raise InputError(f"the function {self.name!r} must take (quantities), not "
                             f"{signature(self._function)}")

    def __call__(self, quantities: Mapping[str, float]) -> bool:
        try:
            answer = self._function(quantities)
        except (Exception, SystemExit) as error:  # a user's function may fail in any way
            self._blame(error)
        try:
            return bool(answer)
        except Exception as error:  # of an array, say
            function = self._function
            named = function if hasattr(function, "__qualname__") else type(function)
            raise ModelError(f"stop.when: {place_of(named)} returned {reprlib.repr(answer)}; "
                             "wanted: true or false") from error

    def _blame(self, error: BaseException) -> NoReturn:
        """Name the function, and the last line of its file that ran."""
        called = error.__traceback__.tb_next if error.__traceback__ else None
        own = [(frame.f_code.co_filename, line) for frame, line in walk_tb(called)]
        at = [f" at {Path(file).name}:{line}" for file, line in own if file == own[0][0]]
        raise ModelError(f"stop.when: {self.name} raised {described(error)}"
                         f"{at[-1] if at else ''}") from error


def _takes_one(function: Callable[..., object]) -> bool:
    try:
        taken = signature(function)
    except (TypeError, ValueError):  # of a built-in function
        return True
    try:
        taken.bind(None)
    except TypeError:
        return False
    return True
