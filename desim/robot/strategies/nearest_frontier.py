"""Nearest frontier: every robot drives to the frontier with the shortest way (Yamauchi 1998)."""

from desim import ports


class NearestFrontier:
    """Choose the nearest frontier. Robots coordinate through their shared maps alone."""

    class Params(ports.Params):
        """None."""

    def __init__(self, params: Params) -> None:
        self.params = params

    def choose(self, view: ports.ExplorationView) -> ports.Frontier | None:
        return next(iter(view.frontiers(limit=1)), None)
