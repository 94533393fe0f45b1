"""The last contact of a robot with its team, on which the failsafes of strategies depend."""

from collections.abc import Iterable

from desim import ports


class Contact:
    """The time since a robot last heard of a teammate, and its place then."""

    def __init__(self) -> None:
        self.place: ports.Place | None = None  # where somebody was last heard
        self._heard_ns = -1  # the time at which it was there
        self._since_ns: int | None = None  # the time of the first call

    def silent_ns(self, context: ports.StrategyContext, names: Iterable[str] | None = None) -> int:
        """The time since a teammate (one of ``names``) was last heard of, or since the first call
        if none ever was. Notes the robot's place if one was heard since the last call."""
        if self._since_ns is None:
            self._since_ns = context.now_ns
        links = context.links()
        heard_ns = max((link.heard_ns for name, link in links.items()
                        if names is None or name in names), default=-1)
        if heard_ns > self._heard_ns and context.pose is not None:
            self._heard_ns, self.place = heard_ns, ports.Place(*context.pose[:2])
        return context.now_ns - max(heard_ns, self._since_ns if heard_ns < 0 else 0)
