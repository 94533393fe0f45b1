"""The monitor's ear on the network: the traffic between controllers and monitor ends here.

What arrives is counted and timed like any message. The verdict on the run does not depend on it:
the monitor proper watches out of band, so that no load can delay it.
"""

from __future__ import annotations

from desim.middleware.graph import Host, Message, Node


class MonitorNode(Node):
    """Subscribes to every robot's explored map and travelled distance."""

    def __init__(self, host: Host, robots: tuple[str, ...]) -> None:
        super().__init__(host, "monitor")
        self._robots = robots

    def start(self) -> None:
        for robot in self._robots:
            self.subscribe(f"/{robot}/explored_map", self._note)
            self.subscribe(f"/{robot}/distance", self._note)

    def _note(self, message: Message) -> None:
        """Nothing to do with it here; that it came is in the trace."""
