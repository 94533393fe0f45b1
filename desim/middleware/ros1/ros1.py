"""``ros1``: one master for all."""

from __future__ import annotations

from pydantic import Field

from desim.errors import host_index
from desim.middleware.ros1.parameters import RosParams
from desim.middleware.ros1.processes import Processes, RosMiddleware
from desim.ports.middleware import MiddlewareContext


class Ros1(RosMiddleware):
    """Publishers and subscribers find each other through one master and then talk directly."""

    class Params(RosParams):
        """The parameters of ROS 1, and the host of the master."""

        master: str | None = Field(None, description=(
            "the host of the master (default: workstation, else base, else the first host)"))

    def __init__(self, params: Params) -> None:
        self._params = params

    def start(self, context: MiddlewareContext) -> None:
        name, hosts = self._params.master, context.hosts
        if name is None:
            name = next((name for name in ("workstation", "base") if name in hosts), hosts[0])
        masters = [host_index("master", name, hosts)] * len(hosts)
        self.processes = Processes(context, self._params, masters, context.sees)
