"""numba's names for declarations of kernels, looked up when a kernel is compiled.

A module of kernels writes ``types.float64[:, ::1]`` as numba has it, but importing numba takes a
third of a second, which a run whose kernels are in the cache does not need.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache, update_wrapper
from typing import Any


class Deferred:
    """An expression over numba's names: its attributes, items and calls are expressions, too."""

    def __init__(self, value: Callable[[], Any]) -> None:
        self._value = value

    def __getattr__(self, name: str) -> Deferred:
        return Deferred(lambda: getattr(self._value(), name))

    def __getitem__(self, index: Any) -> Deferred:
        return Deferred(lambda: self._value()[index])

    def __call__(self, *arguments: Any, **words: Any) -> Deferred:
        return Deferred(lambda: self._value()(*map(value_of, arguments), **words))


class Called:
    """A function of numba's that kernels call."""

    def __init__(self, function: Callable[[], Any]) -> None:
        self._function = cache(function)

    @property
    def _numba_type_(self) -> Any:  # numba's own protocol: the type of a name in a kernel
        from numba.core.registry import cpu_target

        function = self._function()
        cpu_target.typing_context.refresh()
        cpu_target.target_context.refresh()
        return cpu_target.typing_context.resolve_value_type(function)


def value_of(expression: Any) -> Any:
    """The value of an expression, or of a list or tuple of them; anything else is its own value."""
    if isinstance(expression, Deferred):
        return expression._value()
    if type(expression) in (list, tuple):
        return type(expression)(map(value_of, expression))
    return expression


def intrinsic(code: Callable[..., Any]) -> Called:
    """``numba.extending.intrinsic``: a function of kernels written as machine code."""

    def typed(*arguments: Any) -> Any:
        signature, machine_code = code(*arguments)
        return value_of(signature), machine_code

    def made() -> Any:
        from numba.extending import intrinsic

        return intrinsic(update_wrapper(typed, code))

    return Called(made)


def _numba() -> Any:
    import numba

    return numba


numba = Deferred(_numba)
types, from_dtype = numba.types, numba.from_dtype
carray = Called(lambda: _numba().carray)
