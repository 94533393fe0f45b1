"""The memory of a host whose callbacks take time: what the processes of its nodes keep."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from desim.computers.memory import Memory
from desim.ports.arguments import check_kept
from desim.ports.computers import Kept

if TYPE_CHECKING:
    from desim.middleware.busy.host import BusyHost
    from desim.middleware.node import Node


class HostMemory:
    """The memory of ``host`` while it is up, by what its nodes keep at the moment (``Node.kept``).

    A process takes memory when it runs. So a limit is checked after each callback. If the processes
    need more, the largest one is killed (Linux, mm/oom_kill.c: ``oom_badness``): ``kills`` gets its
    name, the trace a row ``out_of_memory``, and ``Simulation`` stops the host. ``first_bytes``: the
    memory in use after the first callback since the last start, where there is a limit.
    """

    __slots__ = ("kills", "first_bytes", "host", "_memory", "_sizes", "_known", "_nodes", "_dying")

    def __init__(self, host: BusyHost, memory: Memory) -> None:
        self.kills: list[str] = []
        self.first_bytes = 0
        self.host, self._memory = host, memory
        self._sizes: dict[str, int] = {}  # of each node's process, after its last callback
        # By node: the bytes that waited and what else it kept when it was last asked, and the
        # memory that this takes.
        self._known: dict[str, tuple[int, Mapping[str, int], int]] = {}
        self._nodes: dict[str, Node] = {}  # by name
        self._dying = False

    @property
    def limit_bytes(self) -> int | None:
        """None: there is no limit."""
        return self._memory.limit_bytes

    def used_bytes(self) -> int:
        """The memory in use now; 0 of a host that is down."""
        if not self.host.up:
            return 0
        return self._memory.system_bytes() + sum(self.of_processes().values())

    def of_processes(self) -> dict[str, int]:
        """The memory of each process by its node, now."""
        return {node.name: self._of(node) for node in self.host.nodes}

    def check_limit(self, name: str) -> None:
        """A callback of the node ``name`` has been called. Kill the largest process if more memory
        is in use than the limit."""
        limit_bytes = self._memory.limit_bytes
        if limit_bytes is None or self._dying:
            return
        sizes = self._sizes
        if not sizes:
            self._nodes = {node.name: node for node in self.host.nodes}
            sizes = self._sizes = self.of_processes()
            self.first_bytes = self._memory.system_bytes() + sum(sizes.values())
        else:
            size_bytes = self._of(self._nodes[name]) if name in self._nodes else 0
            if size_bytes == sizes.get(name, 0):  # as most often: the others' are as they were
                return
            sizes[name] = size_bytes
        used_bytes = self._memory.system_bytes() + sum(sizes.values())
        if used_bytes > limit_bytes:
            self._dying = True
            self._kill(max(sizes, key=sizes.__getitem__), used_bytes, limit_bytes)

    def freed(self) -> None:
        """The host has stopped."""
        self._dying = False
        self._sizes = {}

    def _of(self, node: Node) -> int:
        name = node.name
        waiting_bytes, kept = self.host.waiting_bytes(name), node.kept()
        known = self._known.get(name)
        if known is not None and known[0] == waiting_bytes and known[1] == kept:
            return known[2]
        quantities = {"bytes": waiting_bytes, **kept}
        check_kept(f"node {name!r}", quantities)
        size_bytes = self._memory.process_bytes(Kept(self.host.program(name), quantities))
        self._known[name] = waiting_bytes, dict(kept), size_bytes  # a node may change its own
        return size_bytes

    def _kill(self, node: str, used_bytes: int, limit_bytes: int) -> None:
        self.kills.append(node)
        host, graph = self.host, self.host.graph
        row = graph.names.id(node), used_bytes, limit_bytes
        graph.trace.row(graph.kernel.now_ns, graph.names.id("out_of_memory"), host.id, *row)
        graph.listeners["out_of_memory"](host.name, *row)
