"""Compiling kernels with numba: those of a module become one unit of machine code.

numba compiles each function for itself, with all that it calls, and again inside each of its
callers. In a unit a function is typed and lowered once, and optimized once, with its callers.
"""

from __future__ import annotations

import gc
from collections.abc import Sequence
from functools import cache
from typing import Any

import numba
from numba.core import types
from numba.core.codegen import AOTCodeLibrary, AOTCPUCodegen, JITCPUCodegen
from numba.core.compiler import Flags, compile_extra
from numba.core.compiler_lock import global_compiler_lock
from numba.core.registry import cpu_target
from numba.core.sigutils import normalize_signature
from numba.core.typing.templates import make_concrete_template, signature

from desim.compiler import machine_code
from desim.compiler.deferred import value_of
from desim.compiler.entry import Entry
from desim.compiler.kernel import CompiledKernel
from desim.compiler.memory import define_memory
from desim.compiler.store import symbol_of

Numba = Any  # numba has no types

_ERROR_MODEL = {True: "python", False: "numpy"}  # by whether a kernel allocates


class _Library(AOTCodeLibrary):
    """Functions that are optimized once, when all of them are there."""

    def _optimize_functions(self, module: Numba) -> None:
        module.data_layout = self._codegen._data_layout  # numba optimizes each for itself: 5 %


class _Codegen(AOTCPUCodegen):
    """Machine code to keep, but for this processor: the same that numba runs at once."""

    _library_class = _Library
    _customize_tm_options = JITCPUCodegen._customize_tm_options
    _customize_tm_features = JITCPUCodegen._customize_tm_features


class Unit:
    """Kernels that are compiled together, with all that they call."""

    present: Unit | None = None  # the one that is being compiled

    def __init__(self, name: str) -> None:
        self._target = cpu_target.target_context.subtarget(
            _internal_codegen=_Codegen(name), aot_mode=True)
        self._library = self._target.codegen().create_library(name)
        self._types: dict[CompiledKernel, Numba] = {}
        self._compiled: dict[CompiledKernel, Numba] = {}

    def compile(self, kernels: Sequence[CompiledKernel]) -> tuple[bytes, list[str]]:
        """The object code of ``kernels``, each with an entry for Python, and the symbols that it
        needs; no code if it needs some of numba's run-time library, which the process has not."""
        with global_compiler_lock:
            before, Unit.present = Unit.present, self
            collects = gc.isenabled()
            gc.disable()  # it would search all of numba's objects again and again: 13 % of the time
            try:
                return self._object_code(kernels)
            finally:
                Unit.present = before
                if collects:
                    gc.enable()

    def _object_code(self, kernels: Sequence[CompiledKernel]) -> tuple[bytes, list[str]]:
        entries = self._library.create_ir_module("entries")
        define_memory(entries)
        for kernel in kernels:
            self.type_of(kernel)
            Entry(self._target, entries, self._compiled[kernel], symbol_of(kernel), kernel.__name__)
        self._library.add_ir_module(entries)
        symbols = {symbol_of(kernel) for kernel in kernels}
        for function in self._library.get_defined_functions():
            if function.name.startswith("NRT_"):  # memory, of what is linked after this, too
                function.linkage = "linkonce_odr"
            elif function.name not in symbols:
                function.linkage = "internal"  # gone where inlined, and its unused arguments
        self._library.finalize()
        module = self._library._final_module
        wanted = [each.name for each in (*module.functions, *module.global_variables)
                  if each.is_declaration and not each.name.startswith("llvm.")]
        return (b"" if machine_code.missing(wanted) else self._library.emit_native_object(), wanted)

    def type_of(self, kernel: CompiledKernel) -> Numba:
        """The type of a kernel that another one calls; it is compiled if it is not yet."""
        if kernel not in self._types:
            self._types[kernel] = self._function(kernel)
        return self._types[kernel]

    def _function(self, kernel: CompiledKernel) -> Numba:
        key, typed = (self, kernel), []
        for declared in kernel.signatures:
            arguments, result = normalize_signature(value_of(declared))
            flags = Flags()
            flags.no_compile = flags.no_cpython_wrapper = flags.no_cfunc_wrapper = True
            flags.nrt = kernel.allocates
            flags.error_model = _ERROR_MODEL[kernel.allocates]
            compiled = compile_extra(cpu_target.typing_context, self._target, kernel.python,
                                     arguments, result, flags, {}, library=self._library)
            self._target.insert_user_function(key, compiled.fndesc)
            self._compiled[kernel] = compiled.fndesc
            typed.append(signature(result, *arguments))
        return types.Function(make_concrete_template(kernel.__name__, key, typed))


def type_of(kernel: CompiledKernel) -> Numba:
    """numba's type of a kernel: in a unit, or in a function that numba compiles for somebody else.
    """
    if Unit.present is not None:
        return Unit.present.type_of(kernel)
    return types.Dispatcher(dispatcher(kernel))


@cache
def dispatcher(kernel: CompiledKernel) -> Numba:
    """The kernel as numba compiles it by itself."""
    return numba.njit(value_of(kernel.signatures), cache=True, _nrt=kernel.allocates,
                      error_model=_ERROR_MODEL[kernel.allocates])(kernel.python)
