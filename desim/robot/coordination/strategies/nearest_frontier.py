"""Nearest frontier: every robot drives to the frontier that is nearest to it (Yamauchi 1998)."""

from desim import ports


def nearest(context: ports.StrategyContext) -> ports.Frontier | None:
    """The reachable frontier that the search meets first; None without one."""
    found = context.frontiers(limit=1)
    context.show("way", [ports.Mark(*one[:2], f"way {one.path_m:.0f} m") for one in found])
    return next(iter(found), None)


class NearestFrontier:
    """Choose the frontier that the search for paths meets first: the one with the nearest cell.

    That need not be the one with the shortest path, which ends at the cell that robots drive to.
    Robots coordinate through their shared maps alone.
    """

    class Params(ports.Params):
        """None."""

    def __init__(self, params: Params) -> None:
        self.params = params

    def choose(self, context: ports.StrategyContext) -> ports.Frontier | None:
        return nearest(context)
