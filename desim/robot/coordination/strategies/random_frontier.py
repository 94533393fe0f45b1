"""Random frontier: the baseline that coordination has to beat."""

from desim import ports


class RandomFrontier:
    """Choose any of the reachable frontiers, all equally likely."""

    class Params(ports.Params):
        """None."""

    def __init__(self, params: Params) -> None:
        self.params = params

    def choose(self, context: ports.StrategyContext) -> ports.Frontier | None:
        frontiers = context.frontiers()
        if not frontiers:
            return None
        return frontiers[int(context.stream("choice").integers(len(frontiers)))]
