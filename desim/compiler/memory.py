"""Memory of arrays that a kernel makes for itself: they are gone when it returns.

numba's own allocator is a part of its C extensions, and counts what it gives out; compiled kernels
shall run without either.
"""

from __future__ import annotations

from typing import Any

from llvmlite import ir
from numba.core import cgutils
from numba.core.runtime.nrtdynmod import _meminfo_struct_type as _block

LlvmModule = Any  # llvmlite has no types

_i8, _i32, _word = ir.IntType(8), ir.IntType(32), _block.elements[0]
_pointer = _i8.as_pointer()
_HEAD = 64  # bytes in front of the array, more than ``_block`` has


def define_memory(module: LlvmModule) -> None:
    """Define what numba's array code asks for: a counted block of memory, and its end."""
    malloc = ir.Function(module, ir.FunctionType(_pointer, [_word]), "malloc")
    free = ir.Function(module, ir.FunctionType(ir.VoidType(), [_pointer]), "free")
    allocate = ir.Function(module, ir.FunctionType(_pointer, [_word, _i32]),
                           "NRT_MemInfo_alloc_aligned")
    builder = ir.IRBuilder(allocate.append_basic_block())
    size, alignment = allocate.args
    slack = builder.zext(alignment, _word)
    block = builder.call(malloc, [builder.add(builder.add(size, slack), _word(_HEAD))])
    with builder.if_then(cgutils.is_null(builder, block), likely=False):
        builder.ret(block)
    start = builder.add(builder.ptrtoint(block, _word), builder.add(slack, _word(_HEAD)))
    start = builder.sub(start, builder.urem(start, slack))
    fields = builder.bitcast(block, _block.as_pointer())
    for k, value in enumerate((_word(1), _pointer(None), _pointer(None),
                               builder.inttoptr(start, _pointer), size)):
        builder.store(value, cgutils.gep(builder, fields, 0, k))
    builder.ret(block)
    end = ir.Function(module, ir.FunctionType(ir.VoidType(), [_pointer]), "NRT_MemInfo_call_dtor")
    builder = ir.IRBuilder(end.append_basic_block())
    builder.call(free, end.args)
    builder.ret_void()
