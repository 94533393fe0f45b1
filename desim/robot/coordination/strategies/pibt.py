"""Traffic by priority inheritance with backtracking (Okumura et al. 2022), planned on a host."""

from desim import ports
from desim.robot.coordination.traffic.control import TrafficParams
from desim.robot.coordination.traffic.journeys import JourneysTraffic
from desim.robot.coordination.traffic.planners import Pibt


class PibtTraffic(JourneysTraffic):
    """Robots get to their goals over cells that a host without a body grants them; it plans one
    step at a time by PIBT (Okumura, Machida, Defago, Tamura 2022). Without messages all stand."""

    class Params(TrafficParams):
        """Those of all that plan on cells."""

    def planner(self, host: ports.StrategyContext) -> Pibt:
        """See ``TrafficControl``."""
        return Pibt(host.stream("ties"))
