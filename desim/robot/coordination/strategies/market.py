"""A market: robots offer frontiers, others bid for them, awards go out (Zlot et al. 2002)."""

import math

from pydantic import Field

from desim import ports
from desim.robot.coordination.contact import Contact
from desim.robot.coordination.strategies.nearest_frontier import nearest
from desim.units import Duration, Period

_SAME_M = 2.0  # frontiers so near to each other are one (ours)
_BIDS = 3  # of a bidder for the lots of an offer: its best ones


class Market:
    """Drive to the most profitable frontier that nobody else holds, and offer it and the next best
    ones to the team: the robot with the highest profit gets each (Zlot, Stentz, Dias, Thayer 2002).

    The profit is the area in view at the frontier, times a price, minus the length of the path. For
    a robot that has a goal the path leads over that goal, unless the frontier is nearer. The area
    is the least that anybody has reported for the frontier: bidders report what they know better.
    Each bidder bids for its three best lots at most, and wins one of an offer. The winners are
    published, and no robot takes a frontier that another one holds. A frontier is free again when
    its holder's drive has ended, when the holder is out of reach, or when it has held the frontier
    for too long. Failsafe: a robot that has heard nobody for ``failsafe_after`` goes on alone as
    ``nearest_frontier``.
    """

    class Params(ports.Params):
        lots: int = Field(4, ge=1, description=(
            "frontiers in an offer (maze_8, seeds 1 to 3: 133 s; 8 lots: 148 s)"))
        price_m_per_m2: float = Field(0.2, ge=0, description=(
            "way that 1 m2 of unknown area in view is worth (maze_8, seeds 1 to 3: 133 s; 0: "
            "152 s)"))
        wait_ns: Period = Field("0.5 s", description="time for bids (the exploration's rate)")
        hold_ns: Period = Field("20 s", description=(
            "time for which a frontier is held at most (a drive of 24 m at 1.2 m/s)"))
        failsafe_after_ns: Duration = Field("30 s", description=(
            "without any word of the team: go on alone (six periods of the exchange of maps)"))

    traits = ports.StrategyTraits(reads_team_state=True)

    def __init__(self, params: Params) -> None:
        self._params, self._contact = params, Contact()
        # Frontiers that other robots hold: which robot, until when.
        self._held: dict[ports.Place, tuple[str, int]] = {}
        # The areas in view at frontiers that teammates have reported as less than what was offered.
        self._reported_m2: dict[ports.Place, float] = {}
        # Frontiers that this robot offers: the shortest way to each, and whose it is.
        self._lots: dict[ports.Place, tuple[float, str]] = {}
        self._offered_ns = 0

    def on_start(self, robot: ports.StrategyContext) -> None:
        for topic, callback in (("offer", self._on_offer), ("bid", self._on_bid),
                                ("award", self._on_award), ("release", self._on_release)):
            robot.advertise(topic, queue=10)
            robot.subscribe(topic, callback)

    def on_teammate(self, robot: ports.StrategyContext, name: str, heard: bool) -> None:
        if not heard:
            self._set_held(robot, {place: held for place, held in self._held.items()
                                   if held[0] != name})

    def on_goal(self, robot: ports.StrategyContext, place: ports.Place, end: ports.GoalEnd) -> None:
        robot.publish("release", place)

    def choose(self, robot: ports.StrategyContext) -> ports.Frontier | None:
        if self._contact.silent_ns(robot) >= self._params.failsafe_after_ns:
            return nearest(robot)
        profits = self._profits(robot)
        if not profits:
            return nearest(robot)
        if not self._lots:
            best = sorted(profits, key=lambda one: -profits[one])[:self._params.lots]
            self._lots = {ports.Place(*one[:2]): (one.path_m, robot.name) for one in best}
            self._offered_ns = robot.now_ns
            self._show_lots(robot)
            robot.publish("offer", [[*lot, way_m, self._gain_m2(robot, lot)]
                                    for lot, (way_m, _) in self._lots.items()])
            robot.after(self._params.wait_ns, self._award)
        return max(profits, key=lambda one: profits[one])

    def _profits(self, robot: ports.StrategyContext) -> dict[ports.Frontier, float]:
        """The profit of each frontier that no other robot holds."""
        self._set_held(robot, {place: held for place, held in self._held.items()
                               if held[1] > robot.now_ns})
        return {one: self._revenue_m(robot, one) - one.path_m for one in robot.frontiers()
                if not any(self._is_same(one, place) for place in self._held)}

    def _revenue_m(self, robot: ports.StrategyContext, place: tuple[float, ...]) -> float:
        return self._params.price_m_per_m2 * self._gain_m2(robot, place)

    def _gain_m2(self, robot: ports.StrategyContext, place: tuple[float, ...]) -> float:
        """The area in view at ``place`` that neither the robot nor a teammate who said so knows; 0
        where it has no price."""
        if not self._params.price_m_per_m2:
            return 0.0
        return min([robot.gain_m2((place[0], place[1])),
                    *(gain_m2 for at, gain_m2 in self._reported_m2.items()
                      if self._is_same(place, at))])

    def _is_same(self, place: tuple[float, ...], other: tuple[float, ...]) -> bool:
        return math.dist(place[:2], other[:2]) <= _SAME_M

    # ------------------------------------------------------------------------- as a seller

    def _on_bid(self, robot: ports.StrategyContext, bid: ports.StrategyMessage) -> None:
        for x_m, y_m, gain_m2 in bid.content["gains"]:
            self._reported_m2[ports.Place(x_m, y_m)] = gain_m2
        if bid.content["offer"] == [robot.name, self._offered_ns]:
            for x_m, y_m, way_m in bid.content["bids"]:
                lot = ports.Place(x_m, y_m)
                if lot in self._lots:  # else the bid comes too late
                    self._lots[lot] = min(self._lots[lot], (way_m, bid.source))
            self._show_lots(robot)

    def _award(self, robot: ports.StrategyContext) -> None:
        """End the auction. Each bidder gets the best of the lots that it has won. Of its own lots
        the seller keeps its goal alone."""
        best: dict[str, tuple[float, ports.Place]] = {}
        for lot, (way_m, bidder) in self._lots.items():
            profit_m = self._revenue_m(robot, lot) - way_m
            best[bidder] = max(best.get(bidder, (-math.inf, lot)), (profit_m, lot))
        winners = {lot: bidder for bidder, (_, lot) in best.items()}
        self._lots = {}
        self._show_lots(robot)
        for lot, winner in winners.items():
            if winner != robot.name:
                self._hold(robot, lot, winner)
        if robot.goal is not None and any(self._is_same(robot.goal, lot)
                                          for lot in (*self._held, *self._reported_m2)):
            self._change_goal(robot)
        robot.publish("award", [[winner, *lot] for lot, winner in winners.items()
                                if winner != robot.name or lot == robot.goal])

    # -------------------------------------------------------------------------- as a buyer

    def _on_offer(self, robot: ports.StrategyContext, offer: ports.StrategyMessage) -> None:
        if robot.pose is None:
            return
        lots = [ports.Place(*one[:2]) for one in offer.content]
        if robot.goal is None:
            ways_m = robot.path_lengths_m(lots).tolist()
        else:
            rest_m, *ways_m = robot.path_lengths_m([robot.goal, *lots]).tolist()
            beyond_m = robot.path_lengths_m(lots, robot.goal).tolist()
            ways_m = [way_m if way_m < rest_m else rest_m + more_m
                      for way_m, more_m in zip(ways_m, beyond_m, strict=True)]
        gains_m2 = [self._gain_m2(robot, lot) for lot in lots]
        gains = [[*lot, own_m2] for lot, own_m2, (*_, gain_m2) in zip(
            lots, gains_m2, offer.content, strict=True) if own_m2 < gain_m2]
        price = self._params.price_m_per_m2
        bids = [[*lot, way_m] for _, lot, way_m in sorted(
            (way_m - price * own_m2, lot, way_m) for lot, own_m2, way_m, (_, _, asked_m, _) in zip(
                lots, gains_m2, ways_m, offer.content, strict=True) if way_m < asked_m)[:_BIDS]]
        if bids or gains:
            robot.publish("bid", {"offer": [offer.source, offer.sent_ns], "bids": bids,
                                  "gains": gains})

    def _on_award(self, robot: ports.StrategyContext, award: ports.StrategyMessage) -> None:
        """Note the frontiers that others hold; drive to a frontier just won if it is nearer than
        the goal."""
        own = [ports.Place(*lot) for winner, *lot in award.content if winner == robot.name]
        for winner, x_m, y_m in award.content:
            if winner != robot.name:
                self._hold(robot, ports.Place(x_m, y_m), winner)
        if robot.goal is not None and any(
                self._is_same(robot.goal, lot) for winner, *lot in award.content
                if winner != robot.name):
            self._change_goal(robot)
        if own and robot.pose is not None:
            places = own if robot.goal is None else [robot.goal, *own]
            ways_m = robot.path_lengths_m(places).tolist()
            way_m, place = min(zip(ways_m, places, strict=True))
            if math.isfinite(way_m):
                robot.go(place)

    def _on_release(self, robot: ports.StrategyContext, release: ports.StrategyMessage) -> None:
        self._set_held(robot, {
            place: held for place, held in self._held.items()
            if held[0] != release.source or not self._is_same(place, release.content)})

    def _hold(self, robot: ports.StrategyContext, place: ports.Place, name: str) -> None:
        """Note who holds ``place``, unless it is out of reach: nobody would hear of its end."""
        if name in robot.links():
            until_ns = robot.now_ns + self._params.hold_ns
            self._set_held(robot, {**self._held, place: (name, until_ns)})

    def _set_held(self, robot: ports.StrategyContext,
                  held: dict[ports.Place, tuple[str, int]]) -> None:
        if held != self._held:
            self._held = held
            robot.show("held", (ports.Mark(*place, name)
                                for place, (name, _) in held.items()))

    def _show_lots(self, robot: ports.StrategyContext) -> None:
        robot.show("bid", (ports.Mark(*lot, f"{bidder}: way {way_m:.0f} m")
                           for lot, (way_m, bidder) in self._lots.items()))

    def _change_goal(self, robot: ports.StrategyContext) -> None:
        """Another robot holds the goal: drive to the best other frontier, if there is one."""
        profits = self._profits(robot)
        if profits:
            robot.go(max(profits, key=lambda one: profits[one]))
