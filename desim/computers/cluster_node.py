"""A node of a cluster: its virtual machines share its processors."""

from __future__ import annotations

from collections.abc import Sequence

from desim.computers.processors import Processors
from desim.engine.kernel import Kernel
from desim.errors import KernelError


class ClusterNode:
    """``count`` physical processors for the virtual ones of ``machines``, all machines of the node.

    A virtual processor wants a physical one while it has a job. All that want one run at the same
    rate, at most that of a physical one. For the node they are threads, to which it gives short
    time slices; it knows nothing of the jobs. (So processors are shared on two levels: a job's rate
    is its share of a virtual processor, times that one's share of a physical one.) Raises
    ``KernelError`` unless ``count`` is an int >= 1.
    """

    __slots__ = ("count", "machines", "_kernel", "_wanted", "_since_ns", "_waited_ns")

    def __init__(self, kernel: Kernel, count: int, machines: Sequence[Processors]) -> None:
        if type(count) is not int or count < 1:
            raise KernelError(f"a node has an int count of processors >= 1, got {count!r}")
        self.count, self.machines, self._kernel = count, tuple(machines), kernel
        self._since_ns = kernel.now_ns
        self._wanted = 0  # processors, since then
        self._waited_ns = 0  # until then
        if sum(machine.count for machine in machines) > count:  # else they never wait
            for machine in machines:
                machine.cluster_node = self

    def busy_ns(self) -> int:
        """The time for which processors have been busy so far, summed over all of them."""
        return sum(machine.busy_ns() for machine in self.machines) - self.waited_ns()

    def waited_ns(self) -> int:
        """The time for which virtual processors have had jobs and no physical processor so far,
        summed over all of them: what Linux calls steal."""
        lacking = max(self._wanted - self.count, 0)
        return self._waited_ns + lacking * (self._kernel.now_ns - self._since_ns)

    def share_out(self) -> None:
        """A machine may want more or fewer processors than before: share them out again."""
        wanted = self._now_wanted()
        if wanted > self.count:
            for machine in self.machines:  # jobs whose end is no event may be done
                machine.advance()
            wanted = self._now_wanted()
        if wanted == self._wanted:
            return
        self._waited_ns, self._since_ns = self.waited_ns(), self._kernel.now_ns
        scarce = self._wanted > self.count or wanted > self.count
        self._wanted = wanted
        if scarce:
            share = (self.count, wanted) if wanted > self.count else None
            for machine in self.machines:
                machine.set_physical_share(share)

    def _now_wanted(self) -> int:
        return sum(machine.wanted for machine in self.machines)
