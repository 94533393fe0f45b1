"""Nearest frontier: every robot drives to the frontier with the shortest way (Yamauchi 1998)."""

from desim import ports


def nearest(context: ports.StrategyContext) -> ports.Frontier | None:
    """The reachable frontier with the shortest way; None without one."""
    return next(iter(context.frontiers(limit=1)), None)


class NearestFrontier:
    """Choose the nearest frontier. Robots coordinate through their shared maps alone."""

    class Params(ports.Params):
        """None."""

    def __init__(self, params: Params) -> None:
        self.params = params

    def choose(self, context: ports.StrategyContext) -> ports.Frontier | None:
        return nearest(context)
