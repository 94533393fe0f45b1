"""The state of compiled network models, the DCF and the switch, and how kernels get it.

There is a record dtype for each kind of thing, an array of records each, and one NamedTuple of
these arrays. ``Addresses`` owns the NamedTuple. A kernel's first argument is ``Addresses.rows``,
from which its ``arrays_at`` makes the NamedTuple again; what differs from call to call are scalars
behind it. Functions that only kernels call take the NamedTuple, or records of it. A kernel that has
no state, but computes one array from others (fading's), takes the arrays themselves.
"""

from __future__ import annotations

from typing import Generic, NamedTuple, TypeVar

import numpy as np

from desim.ports.kernels import intrinsic, types

State = TypeVar("State", bound=NamedTuple)


class Addresses(Generic[State]):
    """Arrays for kernels to find by their addresses.

    Kernels could take the arrays themselves. With numba's own entries, which unpacked each array in
    0.2 us, ten saturated stations of 802.11 took 33 % more CPU time then (minima of 18 runs in
    turns); with those of ``desim.compiler``, 0.02 us, that was not measured again. This object owns
    the arrays: it refers to each as long as ``rows`` has its address, so that no kernel reads
    memory that was freed. Arrays are exchanged by making a new object.

    ``rows`` [states, fields of the NamedTuple, 3]: address and shape of each array.
    """

    def __init__(self, *states: State) -> None:
        self.states = states
        self.rows = np.array([[(array.ctypes.data, *array.shape, 0)[:3] for array in state]
                              for state in states], np.int64)


@intrinsic
def pointer(typing_context, address):
    """The memory at an address."""
    def code(context, builder, signature, arguments):
        return builder.inttoptr(arguments[0], context.get_value_type(signature.return_type))
    return types.voidptr(types.int64), code
