"""Compiled kernels in files: a file for each module of kernels, loaded without numba.

A file begins with a line of JSON: the SHA-256 of the machine code behind it, and the symbols that
this needs from the process. Its name contains a hash of what the machine code depends on. It is in
the user's cache, for this processor, or in ``SHIPPED``, with which a wheel comes and where the hash
is that of the sources alone.
"""

from __future__ import annotations

import hashlib
import json
import os
import sys
import sysconfig
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from functools import cache
from importlib.util import find_spec
from pathlib import Path
from time import perf_counter, process_time
from types import ModuleType

import numpy as np

from desim.compiler import machine_code
from desim.compiler.kernel import CompiledKernel
from desim.errors import InputError

SHIPPED = Path(__file__).with_name("shipped")  # for machine_code.SHIPPED_CPU
_unsaid: list[Callable[[], object]] = []  # called before a kernel is compiled, once each
_spent_s = [0.0, 0.0]  # on compiling: clock time, CPU time


def functions(kernels: Sequence[CompiledKernel], keep: bool) -> list[Callable[..., object]]:
    """The compiled functions of kernels of one module. With ``keep``, which is for all its kernels
    that Python calls, they are read from the file, or compiled and written there."""
    paths = _paths(kernels[0].__module__) if keep else []
    code = next((found for found in map(_read, paths) if found is not None), None)
    if code is None:
        while _unsaid:
            _unsaid.pop()()
        begin_s = perf_counter(), process_time()
        code, symbols = _compiled(kernels)
        _spent_s[:] = [spent_s + end_s - start_s for spent_s, start_s, end_s in zip(
            _spent_s, begin_s, (perf_counter(), process_time()), strict=True)]
        if paths:
            _write(paths[-1], code, symbols)
    if not code:
        from desim.compiler.units import dispatcher

        return [dispatcher(kernel) for kernel in kernels]
    return machine_code.functions(code, [(symbol_of(kernel), kernel.__name__)
                                         for kernel in kernels])


def ship(kernels: Sequence[CompiledKernel], folder: Path) -> None:
    """Compile the kernels of one module that Python calls for ``folder``, which is to be
    ``SHIPPED`` in a wheel. The processor is that of ``NUMBA_CPU_NAME``."""
    module = kernels[0].__module__
    _write(_file(folder, module, _sources(module)), *_compiled(kernels))


def compiling_s() -> tuple[float, float]:
    """Clock time and CPU time that this process has spent on compiling kernels."""
    return _spent_s[0], _spent_s[1]


def symbol_of(kernel: CompiledKernel) -> str:
    """The name of a kernel's function in the machine code."""
    return f"{kernel.__module__}.{kernel.__name__}"


@contextmanager
def announced(say: Callable[[], object]) -> Iterator[None]:
    """Call ``say`` before the first kernel that is compiled inside."""
    _unsaid.append(say)
    try:
        yield
    finally:
        with suppress(ValueError):  # it was called
            _unsaid.remove(say)


def _compiled(kernels: Sequence[CompiledKernel]) -> tuple[bytes, list[str]]:
    """See ``Unit.compile``."""
    from desim.compiler.units import Unit

    return (Unit(kernels[0].__module__).compile(kernels) if machine_code.IS_KNOWN else (b"", []))


def _paths(module: str) -> list[Path]:
    """The files that a module's machine code may be in. The last is the one to write."""
    sources, surroundings = _sources(module), _surroundings()
    own = _file(Path(os.environ["NUMBA_CACHE_DIR"]), module, surroundings + sources)
    # a user who sets numba's variables wants other machine code
    may_be_shipped = machine_code.runs_shipped() and b"\nNUMBA_" not in surroundings
    return [*([_file(SHIPPED, module, sources)] if may_be_shipped else []), own]


def _file(folder: Path, module: str, depends_on: bytes) -> Path:
    return folder / f"{module}-{hashlib.sha256(depends_on).hexdigest()[:16]}.o"


def _sources(module: str) -> bytes:
    """A hash of the sources of a module of kernels."""
    digest = hashlib.sha256()
    for each in _modules_called(sys.modules[module], {}).values():
        with suppress(OSError, TypeError):  # a module without a file has no more than its name
            digest.update(Path(str(each.__file__)).read_bytes())
        for name, value in sorted(vars(each).items()):
            if isinstance(value, (int, float, np.generic, np.dtype)):  # compiled in, as constants
                digest.update(f"{name}={value!r}\n".encode())
            elif isinstance(value, type) and issubclass(value, tuple):
                digest.update(f"{name}={getattr(value, '_fields', ())}\n".encode())
    return digest.digest()


def _modules_called(module: ModuleType, known: dict[str, ModuleType]) -> dict[str, ModuleType]:
    """A module of kernels and, into ``known``, those whose kernels it calls."""
    known[module.__name__] = module
    for value in list(vars(module).values()):
        if isinstance(value, CompiledKernel) and value.__module__ not in known:
            _modules_called(sys.modules[value.__module__], known)
    return known


@cache
def _surroundings() -> bytes:
    """All that machine code depends on beside its sources: versions, the processor, settings."""
    parts = [str(sysconfig.get_config_var("SOABI")), np.__version__, machine_code.cpu()]
    for package in "numba", "llvmlite":
        spec = find_spec(package)  # without importing it
        if spec is not None and spec.origin is not None:
            parts.append((Path(spec.origin).parent / "_version.py").read_text("utf-8"))
    parts += sorted(f"{name}={value}" for name, value in os.environ.items()
                    if name.startswith("NUMBA_") and name != "NUMBA_CACHE_DIR")
    return "\n".join(parts).encode()


def _read(path: Path) -> bytes | None:
    """The machine code in a file; None where there is none, or none that is whole."""
    try:
        line, _, code = path.read_bytes().partition(b"\n")
        head = json.loads(line)
    except (OSError, ValueError):
        return None
    whole = isinstance(head, dict) and head.get("sha256") == hashlib.sha256(code).hexdigest()
    if not whole or (code and machine_code.missing(head["symbols"])):
        return None
    return code


def _write(path: Path, code: bytes, symbols: list[str]) -> None:
    head = {"sha256": hashlib.sha256(code).hexdigest(), "symbols": symbols}
    part = path.with_suffix(f".{os.getpid()}")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        part.write_bytes(json.dumps(head).encode() + b"\n" + code)
        part.replace(path)
    except OSError as error:
        raise InputError(f"compiled kernels cannot be kept in {path.parent} "
                         f"({error.strerror}); set NUMBA_CACHE_DIR to a folder that can be "
                         "written") from error
