"""Kernels: functions of loops over arrays, compiled and called from Python.

A kernel is an ordinary Python function with a signature that numba understands. All kernels of a
module are compiled together when one of them is called first, and kept (``desim.compiler.store``).
"""

from __future__ import annotations

import os
from collections.abc import Callable
from functools import cached_property, update_wrapper
from typing import Any, TypeVar, cast

F = TypeVar("F", bound=Callable[..., object])


class CompiledKernel:
    """A compiled function.

    ``signatures``: its types as numba has them, text or expressions (``desim.compiler.deferred``) |
    ``allocates``: whether it may make arrays, and checks each division for zero | ``is_inner``:
    whether other kernels alone call it.
    """

    __name__: str

    def __init__(self, python: Callable[..., object], signatures: list[object], allocates: bool,
                 is_inner: bool) -> None:
        update_wrapper(self, python)
        self.python = python
        self.signatures, self.allocates, self.is_inner = signatures, allocates, is_inner
        kernels_of(python.__module__)[python.__name__] = self

    @cached_property
    def function(self) -> Callable[..., object]:
        """The function that Python calls, without a detour by this object."""
        from desim.compiler import store

        together = [each for each in kernels_of(self.__module__).values() if not each.is_inner]
        wanted = together if self in together else [self]
        for kernel, function in zip(wanted, store.functions(wanted, keep=wanted is together),
                                    strict=True):
            kernel.__dict__["function"] = function  # as cached_property keeps it
        return self.function

    def __call__(self, *arguments: object) -> object:
        return self.function(*arguments)

    @property
    def _numba_type_(self) -> object:
        """numba's own protocol: the type of a name that stands in a compiled function."""
        from desim.compiler.units import type_of

        return type_of(self)


_modules: dict[str, dict[str, CompiledKernel]] = {}


def kernels_of(module: str) -> dict[str, CompiledKernel]:
    """The kernels that a module has declared, by name."""
    return _modules.setdefault(module, {})


def kernel(signature: Any, *, allocates: bool = True, inner: bool = False) -> Callable[[F], F]:
    """Declare a kernel of one signature, or of a list of them (if only kernels call it).

    ``allocates=False``: it makes no arrays. That switches off numba's reference counting (two
    atomic instructions per array and call) and its check for division by zero (the result is inf or
    NaN, as in numpy). ``inner``: other kernels alone call it, so that no entry
    for Python is compiled (10 ms each). If Python calls it all the same, every process compiles it
    anew.

    With ``NUMBA_DISABLE_JIT`` set it stays a Python function.
    """
    signatures = signature if isinstance(signature, list) else [signature]

    def declared(python: F) -> F:
        if os.environ.get("NUMBA_DISABLE_JIT", "0") != "0":
            return python
        # it is called as ``python`` is
        return cast(F, CompiledKernel(python, signatures, allocates, inner))

    return declared


def compiled_function(kernel: F) -> F:
    """The function that a kernel was compiled to, for frequent calls from Python.

    The kernel is compiled here, not at its first call. It takes two arrays in 0.05 us, by way
    of the kernel in 0.28 us.
    """
    # it is called as the Python function is
    return cast(F, kernel.function) if isinstance(kernel, CompiledKernel) else kernel
