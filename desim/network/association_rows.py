"""The rows of a trace about hosts that hang on access points."""

from __future__ import annotations

from desim.engine.kernel import Kernel
from desim.engine.trace import Trace
from desim.network.medium import Medium
from desim.ports import KnowsHandovers


class AssociationRows:
    """Writes a row when a host of ``medium`` comes to an access point (``associated``) or leaves it
    (``disassociated``), and one for each host at the start (entity: the host; a: the access point,
    0 for none; b: the medium). ``at_start``: of each host that may hang on one, whether it did
    when the run began."""

    def __init__(self, medium: Medium, model: KnowsHandovers, kernel: Kernel, trace: Trace) -> None:
        self._medium, self._kernel, self._trace = medium, kernel, trace
        self._left: dict[int, int] = {}  # by host, on which access point it hangs, or did last
        self.model = model
        self.at_start: dict[str, bool] = {}
        model.follow(self._note)

    def _note(self, host: int, access_point: str | None) -> None:
        medium, names = self._medium, self._trace.names
        if host not in medium.attached:
            return
        self.at_start.setdefault(medium.hosts[host], access_point is not None)
        if access_point is not None:
            self._left[host] = names.id(access_point)
        kind = names.id("disassociated" if access_point is None else "associated")
        self._trace.row(self._kernel.now_ns, kind, names.id(medium.hosts[host]),
                        self._left.get(host, 0), medium.id)
