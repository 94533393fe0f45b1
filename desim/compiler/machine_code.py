"""Machine code in this process: loaded by LLVM, called as functions of a C extension."""

from __future__ import annotations

import ctypes
import platform
import sys
from collections.abc import Callable, Iterable
from functools import cache

import llvmlite.binding as llvm
import numpy as np

# What the entries rely on: 64 bits, and objects of Python with a reference count and a class.
IS_KNOWN = ctypes.sizeof(ctypes.c_void_p) == 8 and object.__basicsize__ == 16
# Python's objects that an entry names, by their symbols.
NDARRAY, TYPE_ERROR, ARITHMETIC_ERROR = OBJECTS = (
    "desim.ndarray", "desim.TypeError", "desim.ArithmeticError")

SHIPPED_CPU = "x86-64-v3"  # of machine code that comes with a wheel: Intel's and AMD's since 2015
# Its features beside those of x86-64-v2 (x86-64 psABI, "micro-architecture levels").
_SHIPPED_FEATURES = "avx", "avx2", "bmi", "bmi2", "f16c", "fma", "lzcnt", "movbe"

_FASTCALL = 0x80  # METH_FASTCALL of methodobject.h


class _Method(ctypes.Structure):
    """``PyMethodDef`` of Python's C API."""

    _fields_ = [("name", ctypes.c_char_p), ("call", ctypes.c_void_p), ("flags", ctypes.c_int),
                ("doc", ctypes.c_char_p)]


_kept: list[object] = []  # the engines, with the machine code of functions


@cache
def _prepare() -> None:
    """Make LLVM ready, and ``OBJECTS`` known to it."""
    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()
    for symbol, thing in zip(OBJECTS, (np.ndarray, TypeError, ArithmeticError), strict=True):
        llvm.add_symbol(symbol, id(thing))
    _kept.append(_engine())  # the first one makes the symbols of this process known to LLVM


def _engine() -> llvm.ExecutionEngine:
    machine = llvm.Target.from_triple(llvm.get_process_triple()).create_target_machine(jit=True)
    return llvm.create_mcjit_compiler(llvm.parse_assembly(""), machine)


def missing(symbols: Iterable[str]) -> list[str]:
    """Those of ``symbols`` that nothing in this process has. LLVM aborts the process if code needs
    one of them."""
    _prepare()
    return [symbol for symbol in symbols if llvm.address_of_symbol(symbol) is None]


def functions(code: bytes, names: Iterable[tuple[str, str]]) -> list[Callable[..., object]]:
    """The functions of ``names`` (symbol, name in Python) in the object code ``code``."""
    _prepare()
    engine = _engine()  # one for each: a module that is imported anew has the same symbols
    _kept.append(engine)
    engine.add_object_file(llvm.ObjectFileRef.from_data(code))
    return [_function(engine.get_function_address(symbol), name) for symbol, name in names]


def _function(address: int, name: str) -> Callable[..., object]:
    new = ctypes.pythonapi.PyCFunction_NewEx
    new.restype, new.argtypes = ctypes.py_object, [ctypes.c_void_p] * 3
    method = _Method(name.encode(), address, _FASTCALL, None)
    # Never freed: at its end Python clears this module first, and then reads what a function that
    # is left refers to (``meth_traverse`` and ``meth_dealloc`` of methodobject.c).
    ctypes.pythonapi.Py_IncRef(ctypes.py_object(method))
    function: Callable[..., object] = new(ctypes.addressof(method), None, None)
    return function


def cpu() -> str:
    """The processor for which machine code is made, and its features."""
    return f"{llvm.get_host_cpu_name()} {llvm.get_host_cpu_features().flatten()}"


def runs_shipped() -> bool:
    """Whether machine code of Linux for ``SHIPPED_CPU`` runs here."""
    if not IS_KNOWN or sys.platform != "linux" or platform.machine() != "x86_64":
        return False
    features = llvm.get_host_cpu_features()
    return all(features.get(feature) for feature in _SHIPPED_FEATURES)
