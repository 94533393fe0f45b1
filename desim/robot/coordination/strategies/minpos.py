"""MinPos: each robot goes where it has the best rank (Bautin, Simonin, Charpillet 2012)."""

from desim import ports


class MinPos:
    """Choose the frontier to which the fewest other robots are nearer; among equals, the nearest.

    Paths of teammates are measured in the robot's own map, from the places where they were last
    heard of.
    """

    class Params(ports.Params):
        """None."""

    traits = ports.StrategyTraits(reads_team_state=True)

    def __init__(self, params: Params) -> None:
        self.params = params

    def choose(self, context: ports.StrategyContext) -> ports.Frontier | None:
        frontiers = context.frontiers()
        ranks = dict.fromkeys(frontiers, 0)
        places = [ports.Place(one.x_m, one.y_m) for one in frontiers]
        for peer in context.peers.values():
            lengths_m = context.path_lengths_m(places, ports.Place(peer.x_m, peer.y_m))
            for frontier, length_m in zip(frontiers, lengths_m.tolist(), strict=True):
                ranks[frontier] += length_m < frontier.path_m
        context.show("rank", (ports.Mark(*one[:2], f"rank {rank}, way {one.path_m:.0f} m")
                              for one, rank in ranks.items()))
        return min(frontiers, key=lambda one: (ranks[one], one.path_m), default=None)
