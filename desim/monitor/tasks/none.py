"""No task: hosts and their networks alone."""

from __future__ import annotations

from desim import ports
from desim.ports.tasks import TaskContext


class NoTask:
    """Nothing is to be done: the run ends when ``stop`` says so. A fleet without robots has this
    one. Reports show what arrived first, which every run has."""

    class Params(ports.Params):
        """None."""

    leads = ("messages_delivered",)

    def __init__(self, params: Params) -> None:
        self.params = params

    def start(self, context: TaskContext) -> None:
        """Nothing has to be prepared."""

    def metrics(self) -> dict[str, object]:
        """None."""
        return {}
