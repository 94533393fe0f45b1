"""The way between a fleet's task and the strategies of its hosts, beside all networks."""

from __future__ import annotations

from collections.abc import Callable

from desim.errors import ModelError


class TaskLink:
    """Hands on what strategies do to the task (``on_act``), and what the task tells to the
    strategies that listen. ``briefing``: what all know from the start."""

    def __init__(self, briefing: object = None) -> None:
        self.briefing = briefing
        self.on_act: Callable[[str, object], object] | None = None
        self._listeners: dict[str, Callable[[object], object]] = {}

    def act(self, host: str, content: object) -> None:
        """The strategy of ``host`` does something. Raises ``ModelError`` where the task takes no
        actions."""
        if self.on_act is None:
            raise ModelError(f"{host}: the task takes no actions, not {content!r}")
        self.on_act(host, content)

    def listen(self, host: str, listener: Callable[[object], object]) -> None:
        """Call ``listener(content)`` for what ``host`` is told, in place of an earlier one."""
        self._listeners[host] = listener

    def notify(self, host: str, content: object) -> None:
        """Tell ``host`` something; nobody may listen."""
        if (listener := self._listeners.get(host)) is not None:
            listener(content)
