"""``multimaster``: a master on each host, kept together by discovery and sync (multimaster_fkie).
"""

from __future__ import annotations

from desim.errors import host_index
from desim.middleware.multimaster.discovery import Discovery
from desim.middleware.multimaster.parameters import MultimasterParams
from desim.middleware.multimaster.sync import Sync, multicall
from desim.middleware.ros1.processes import Processes, RosMiddleware
from desim.ports.middleware import MiddlewareContext


class Multimaster(RosMiddleware):
    """Nodes register with the master of their host; the registrations of other masters are copied
    there."""

    Params = MultimasterParams

    def __init__(self, params: MultimasterParams) -> None:
        self._params = params

    def start(self, context: MiddlewareContext) -> None:
        hosts = context.hosts
        for number, name in enumerate(self._params.robot_hosts):
            host_index(f"robot_hosts.{number}", name, hosts)
        self.processes = Processes(context, self._params, list(range(len(hosts))), None,
                                   {"multicall": multicall})
        self.discoveries: dict[int, Discovery] = {}
        self._syncs: dict[int, Sync] = {}

    def switched(self, host: int, up: bool) -> None:
        if not up and host in self.discoveries:
            self.discoveries.pop(host).stop()
            self._syncs.pop(host).stop()
        super().switched(host, up)
        if up:
            sync = self._syncs[host] = Sync(self.processes, self._params, host)
            sync.discovery = self.discoveries[host] = Discovery(
                self.processes, self._params, host, sync.notify,
                lambda beat, receiver: self.discoveries[receiver].receive(beat))
            self.processes.rpc.serve(host, "monitor", sync.serve)
