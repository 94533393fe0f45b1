"""The rows of a trace about hosts that hang on access points."""

from __future__ import annotations

from desim.engine.kernel import Kernel
from desim.engine.trace import Trace
from desim.network.medium import Medium
from desim.ports import KnowsHandovers


class AssociationRows:
    """Writes a row when a host of ``medium`` comes to an access point (``associated``) or leaves it
    (``disassociated``), and one for each host at the start (entity: the host; a: the access point,
    0 for none; b: the medium)."""

    def __init__(self, medium: Medium, model: KnowsHandovers, kernel: Kernel, trace: Trace) -> None:
        self._medium, self._kernel, self._trace = medium, kernel, trace
        self._left: dict[int, int] = {}  # by host, on which access point it hangs, or did last
        model.follow(self._note)

    def _note(self, host: int, access_point: str | None) -> None:
        medium, names = self._medium, self._trace.names
        if host not in medium.attached:
            return
        if access_point is not None:
            self._left[host] = names.id(access_point)
        kind = names.id("disassociated" if access_point is None else "associated")
        self._trace.row(self._kernel.now_ns, kind, names.id(medium.hosts[host]),
                        self._left.get(host, 0), medium.id)
