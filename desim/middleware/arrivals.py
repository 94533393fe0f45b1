"""The account of messages that have arrived. It is written later, for many at once."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from struct import Struct
from typing import TYPE_CHECKING

import numpy as np

from desim.compiler.kernel import compiled_function
from desim.engine.trace import ROW, Trace, pack
from desim.middleware import kernels
from desim.middleware.counts import EDGES_NS, Tallies
from desim.middleware.fates import OnFate, TakesDeliveries
from desim.middleware.kernels import DELIVERY

if TYPE_CHECKING:
    from desim.middleware.host import Host
    from desim.middleware.message import Message

_enter = compiled_function(kernels.enter)
_pack_delivery = Struct(f"<{DELIVERY.itemsize // 8}q").pack


class Arrivals:
    """Messages that are at hosts, and those that are entered in the account.

    ``on_fate`` is notified of each at once, unless it ``TakesDeliveries``. ``kind`` is the trace id
    of rows ``delivered``. ``reads``: the content of a message is read when it arrives.
    ``tallies``: of all topics. ``last_ns`` [hosts, hosts]: see ``Host``.
    """

    def __init__(self, trace: Trace, kind: int, hosts: Sequence[Host], on_fate: OnFate | None,
                 reads: bool) -> None:
        self._trace, self._kind, self._hosts, self._reads = trace, kind, hosts, reads
        self._ids = np.array([host.id for host in hosts], np.uint64)
        self.last_ns = np.zeros((len(hosts), len(hosts)), np.int64)
        self.tallies = Tallies()
        self._takes = on_fate if isinstance(on_fate, TakesDeliveries) else None
        self.on_fate = on_fate if self._takes is None else None
        self._new: list[bytes] = []  # of dtype DELIVERY
        self._many: list[np.ndarray] = []
        self._keep: Callable[[bytes], object] = self._new.append
        self.note_all = self._many.append  # messages of dtype DELIVERY, of which all is told

    def note(self, message: Message, host: Host, time_ns: int, first_ns: int, last_ns: int
             ) -> None:
        """``message`` is at ``host`` since ``time_ns``; its first and its last frame left at
        ``first_ns`` and ``last_ns``."""
        origin, about, born_ns, seq = message.origin, message.about, message.born_ns, message.seq
        keep, index = self._keep, host.index
        keep(_pack_delivery(message.number, about.id, origin.index, index, message.size_bytes,
                            born_ns, first_ns, last_ns, time_ns, seq, about.place))
        if time_ns == born_ns:  # the row comes behind that of its birth
            self._trace.put(pack(time_ns, self._kind, host.id, origin.id, seq, 0))
        if self._reads:
            message.content  # noqa: B018 - reading computes it
        if self.on_fate is not None:
            self.on_fate(message, index, time_ns, None, first_ns, last_ns)

    def enter(self) -> None:
        """Enter what has been noted: write the rows ``delivered``, and notify all that count."""
        alone = len(self._new)
        if not alone and not self._many:
            return
        delivered = np.concatenate(
            [*self._many, np.frombuffer(b"".join(self._new), DELIVERY)])
        self._many.clear()
        self._new.clear()
        rows, tallies = np.empty(len(delivered), ROW), self.tallies
        _enter(delivered, self._kind, self._ids, EDGES_NS, self.last_ns, tallies.counts,
               tallies.bytes, tallies.latencies, rows.view(np.uint64).reshape(-1, 5))
        unwritten = rows["c"] > 0
        unwritten[:len(rows) - alone] = True
        self._trace.put_rows(rows[unwritten])
        for host in self._hosts:
            if host.on_next_arrival:
                _notify(host, delivered)
        if self._takes is not None:
            self._takes.delivered(delivered)


def _notify(host: Host, delivered: np.ndarray) -> None:
    """Call those who wait for the next arrival of a message of ``host``."""
    own = delivered[delivered["source"] == host.index]
    own = own[own["arrived_ns"].argsort(kind="stable")]
    for receiver, time_ns in zip(own["receiver"].tolist(), own["arrived_ns"].tolist(),
                                 strict=True):
        if receiver in host.on_next_arrival:
            host.on_next_arrival.pop(receiver)(time_ns)
