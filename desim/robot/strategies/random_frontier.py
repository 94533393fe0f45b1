"""Random frontier: what coordination has to be better than."""

from desim import ports


class RandomFrontier:
    """Choose any of the reachable frontiers, all equally likely."""

    class Params(ports.Params):
        """None."""

    def __init__(self, params: Params) -> None:
        self.params = params

    def choose(self, view: ports.ExplorationView) -> ports.Frontier | None:
        frontiers = view.frontiers()
        if not frontiers:
            return None
        return frontiers[int(view.stream("choice").integers(len(frontiers)))]
