"""The node that receives the maps and distances that robots send to the monitor's computer."""

from __future__ import annotations

from desim.middleware.host import Host
from desim.middleware.message import Message
from desim.middleware.node import Node


class MonitorNode(Node):
    """Subscribes to every robot's explored map and travelled distance, and to its goal's ``cost``
    and ``gain`` where they are published.

    The traffic between controllers and monitor ends here: it is counted and timed like any other.
    The verdict on the run does not depend on it: the monitor itself watches out of band, so that no
    load can delay it.
    """

    def __init__(self, host: Host, robots: tuple[str, ...], hears_cost: bool) -> None:
        super().__init__(host, "monitor")
        self._robots = robots
        self._topics = ("explored_map", "distance", *(("cost", "gain") if hears_cost else ()))

    def start(self) -> None:
        for robot in self._robots:
            for topic in self._topics:
                self.subscribe(f"/{robot}/{topic}", self._received)

    def _received(self, message: Message) -> None:
        """Do nothing: the arrival is in the trace."""
