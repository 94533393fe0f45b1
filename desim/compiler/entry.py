"""The way from Python into a compiled kernel: arguments are unpacked, checked and handed over.

An entry is a C function as ``METH_FASTCALL`` of Python's C API wants it. numba's own entries need
numba at run time, and make an object for each array of each call. This one reads numpy's arrays
where they lie.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.np.arrayobj import make_array, populate_array
from numba.np.numpy_support import as_dtype

from desim.compiler.machine_code import ARITHMETIC_ERROR, NDARRAY, TYPE_ERROR

Numba = Any  # numba and llvmlite have no types

# Where numpy's C API has the fields of an array (PyArrayObject_fields, ndarraytypes.h; the same in
# numpy 1 and 2), in bytes on a machine of 64 bits, and of an array's type (PyArray_Descr).
_DATA, _DIMENSIONS, _SHAPE, _STRIDES, _DESCRIPTION, _FLAGS = 16, 24, 32, 40, 56, 64
_KIND_NUMBER = 28
_TYPE = 8  # PyObject.ob_type
_CONTIGUOUS = 0x1

_i8, _i32, _i64 = ir.IntType(8), ir.IntType(32), ir.IntType(64)
_pointer = _i8.as_pointer()


class Entry:
    """Builds the entry of one function into ``module``."""

    def __init__(self, target: Numba, module: Numba, function: Numba, symbol: str,
                 name: str) -> None:
        self._target, self._name = target, name
        self._entry = ir.Function(module, ir.FunctionType(
            _pointer, [_pointer, _pointer.as_pointer(), _i64]), symbol)
        self._builder = ir.IRBuilder(self._entry.append_basic_block())
        self._python = target.get_python_api(self._builder)
        self._failed = self._entry.append_basic_block("failed")
        with self._builder.goto_block(self._failed):
            self._builder.ret(_pointer(None))
        _, given, count = self._entry.args
        wanted = len(function.argtypes)
        self._refuse(self._builder.icmp_signed("!=", count, _i64(wanted)),
                     f"{name} takes {wanted} arguments")
        values = [self._unpack(self._builder.load(self._builder.gep(given, [_i64(k)])), one,
                               f"{name}: argument {k + 1}")
                  for k, one in enumerate(function.argtypes)]
        status, result = target.call_conv.call_function(
            self._builder, target.declare_function(module, function), function.restype,
            function.argtypes, values)
        self._refuse(status.is_error, f"{name} divided by zero, or ran out of memory",
                     ARITHMETIC_ERROR)
        self._builder.ret(self._pack(result, function.restype))

    def _refuse(self, wrong: Numba, message: str, error: str = TYPE_ERROR) -> None:
        with self._builder.if_then(wrong, likely=False):
            self._python.err_set_string(self._object(error), message)
            self._builder.branch(self._failed)

    def _object(self, symbol: str) -> Numba:
        """An object of Python's, by its symbol."""
        return self._python.get_c_object(symbol)

    def _leave_if(self, failed: Numba) -> None:
        """Leave where Python's C API has set an error already."""
        with self._builder.if_then(failed, likely=False):
            self._builder.branch(self._failed)

    def _field(self, thing: Numba, offset: int, kind: Numba) -> Numba:
        place = self._builder.gep(thing, [_i64(offset)])
        return self._builder.load(self._builder.bitcast(place, kind.as_pointer()))

    def _unpack(self, thing: Numba, kind: Numba, where: str) -> Numba:
        if isinstance(kind, types.Array):
            return self._array(thing, kind, where)
        if isinstance(kind, types.BaseTuple):
            return self._tuple(thing, kind, where)
        return self._number(thing, kind)

    def _number(self, thing: Numba, kind: Numba) -> Numba:
        builder, python = self._builder, self._python
        wanted = self._target.get_value_type(kind)
        if isinstance(kind, types.Boolean):
            truth = python.object_istrue(thing)
            self._leave_if(builder.icmp_signed("<", truth, truth.type(0)))
            return builder.icmp_signed("!=", truth, truth.type(0))
        if isinstance(kind, types.Float):
            value = python.float_as_double(thing)
            suspect = builder.fcmp_ordered("==", value, value.type(-1.0))
        elif kind.signed:
            value = python.long_as_longlong(thing)
            suspect = builder.icmp_signed("==", value, value.type(-1))
        else:  # PyLong_AsUnsignedLongLong takes Python's own numbers only
            index = builder.call(cgutils.get_or_insert_function(
                builder.module, ir.FunctionType(_pointer, [_pointer]), "PyNumber_Index"), [thing])
            self._leave_if(cgutils.is_null(builder, index))
            value = python.long_as_ulonglong(index)
            python.decref(index)
            suspect = builder.icmp_signed("==", value, value.type(-1))
        with builder.if_then(suspect, likely=False):
            self._leave_if(cgutils.is_not_null(builder, python.err_occurred()))
        if isinstance(kind, types.Float):
            return value if value.type == wanted else builder.fptrunc(value, wanted)
        return value if value.type == wanted else builder.trunc(value, wanted)

    def _array(self, thing: Numba, kind: Numba, where: str) -> Numba:
        builder = self._builder
        dtype = as_dtype(kind.dtype)
        message = f"{where} is not a numpy array of {kind.ndim} dimensions of {dtype}"
        self._refuse(builder.icmp_unsigned("!=", self._field(thing, _TYPE, _pointer),
                                           self._object(NDARRAY)), message)
        number = self._field(self._field(thing, _DESCRIPTION, _pointer), _KIND_NUMBER, _i32)
        wrong = builder.icmp_signed("!=", self._field(thing, _DIMENSIONS, _i32), _i32(kind.ndim))
        fits = [builder.icmp_signed("==", number, _i32(one)) for one in _numbers(dtype)]
        for one in fits[1:]:
            fits[0] = builder.or_(fits[0], one)
        wrong = builder.or_(wrong, builder.not_(fits[0]))
        if kind.layout == "C":
            flag = builder.and_(self._field(thing, _FLAGS, _i32), _i32(_CONTIGUOUS))
            wrong = builder.or_(wrong, builder.icmp_signed("==", flag, _i32(0)))
            message += ", contiguous"
        self._refuse(wrong, message)
        shapes, strides = (self._field(thing, at, _i64.as_pointer()) for at in (_SHAPE, _STRIDES))
        shape = [builder.load(builder.gep(shapes, [_i64(k)])) for k in range(kind.ndim)]
        items = _i64(1)
        for length in shape:
            items = builder.mul(items, length)
        array = make_array(kind)(self._target, builder)
        populate_array(
            array, data=builder.bitcast(self._field(thing, _DATA, _pointer), array.data.type),
            shape=shape, itemsize=_i64(dtype.itemsize), meminfo=None,
            strides=[builder.load(builder.gep(strides, [_i64(k)])) for k in range(kind.ndim)])
        return array._getvalue()

    def _tuple(self, thing: Numba, kind: Numba, where: str) -> Numba:
        builder, python = self._builder, self._python
        size = python.tuple_size(thing)
        self._leave_if(builder.icmp_signed("<", size, size.type(0)))
        self._refuse(builder.icmp_signed("!=", size, size.type(len(kind))),
                     f"{where} is not a tuple of {len(kind)}")
        parts = [self._unpack(python.tuple_getitem(thing, k), one, f"{where}[{k}]")
                 for k, one in enumerate(kind)]
        return self._target.make_tuple(builder, kind, parts)

    def _pack(self, value: Numba, kind: Numba) -> Numba:
        builder, python = self._builder, self._python
        if isinstance(kind, types.NoneType):
            return python.make_none()
        if isinstance(kind, types.Boolean):
            return python.bool_from_bool(value)
        if isinstance(kind, types.Float):
            return python.float_from_double(
                value if isinstance(value.type, ir.DoubleType)
                else builder.fpext(value, ir.DoubleType()))
        if isinstance(kind, types.BaseTuple):
            packed = python.tuple_new(len(kind))
            for k, one in enumerate(kind):
                python.tuple_setitem(packed, k, self._pack(builder.extract_value(value, k), one))
            return packed
        wide = value if value.type == _i64 else (
            builder.sext if kind.signed else builder.zext)(value, _i64)
        return (python.long_from_longlong if kind.signed else python.long_from_ulonglong)(wide)


def _numbers(dtype: np.dtype) -> Sequence[int]:
    """numpy's numbers of the kinds of items that are equal to ``dtype``: ``long`` and ``long long``
    of 64 bits are two."""
    same = [np.dtype(code) for code in "bBhHiIlLqQ" if np.dtype(code) == dtype]
    return sorted({one.num for one in (dtype, *same)})
