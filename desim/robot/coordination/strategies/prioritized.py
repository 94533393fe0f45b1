"""Traffic by cooperative A* with reservations in time (Silver 2005), planned on a host."""

from desim import ports
from desim.robot.coordination.traffic.control import TrafficParams
from desim.robot.coordination.traffic.journeys import JourneysTraffic
from desim.robot.coordination.traffic.planners import Prioritized


class PrioritizedTraffic(JourneysTraffic):
    """Robots get to their goals over cells that a host without a body grants them; it plans robot
    after robot around earlier reservations (WHCA*, Silver 2005). Without messages all stand."""

    class Params(TrafficParams):
        """Those of all that plan on cells."""

    def planner(self, host: ports.StrategyContext) -> Prioritized:
        """See ``TrafficControl``."""
        return Prioritized()
