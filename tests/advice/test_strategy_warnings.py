"""The warnings of a run whose strategies hear nothing or have nothing to do."""

import pytest
from runs import HELLO, SCENARIOS, built

from desim.advice.warnings import warnings
from desim.plugins import misfit
from desim.robot.coordination.strategies.nearest_frontier import NearestFrontier

SENDS = """
from desim.robot.coordination.strategies.nearest_frontier import NearestFrontier


class Sends(NearestFrontier):
    def on_start(self, robot):
        robot.advertise("bids")
        robot.subscribe({topic!r}, self.on_bid)

    def on_bid(self, robot, message):
        pass
"""


def said(file, *overrides):
    simulation = built(file, *overrides)
    simulation.run()
    return warnings(simulation.monitor)


@pytest.mark.parametrize("topic, warned", [
    ("bits", ["strategies subscribe to 'bits', which none advertises (did you mean 'bids'?)"]),
    ("bids", [])])  # the twin
def test_a_topic_that_no_strategy_advertises_is_a_warning(tmp_path, topic, warned):
    module = f"sends_{topic}"
    (tmp_path / f"{module}.py").write_text(SENDS.format(topic=topic))
    (tmp_path / "own.yaml").write_text(
        f"extends: {HELLO}\nname: own\nstop: {{elapsed: 2 s}}\n"
        f"coordination: {{strategy: '{module}:Sends'}}\n")
    assert said(tmp_path / "own.yaml") == warned


def test_a_strategy_of_exploration_where_the_map_is_known_is_a_warning():
    nothing = ("the strategy 'minpos' has nothing to explore: the task 'patrolling' gives robots "
               "the map; choose one that needs a Patrol (needs of its traits)")

    def of(*overrides):
        return said(SCENARIOS / "patrol.yaml", "stop.elapsed=5 s", *overrides)

    assert nothing in of("coordination.strategy=minpos")
    assert of("coordination.strategy=cyclic_patrol") == []
    assert nothing not in of("coordination.strategy=minpos", "task.map=unknown")


def test_a_method_that_is_named_nearly_like_an_event_is_refused():
    class Late(NearestFrontier):
        def on_strat(self, robot):
            pass

    class Short(NearestFrontier):
        def start(self, robot):
            pass

    class Called(NearestFrontier):
        def on_start(self, robot):
            robot.subscribe("maps", self.on_maps)

        def on_maps(self, robot, message):
            pass

        def on_unlike_anything(self):
            pass

    assert misfit("strategy", Late) == ("have no method on_strat, which is never called (did you "
                                        "mean 'on_start'?)")
    assert misfit("strategy", Short) == ("have no method start, which is never called (did you "
                                         "mean 'on_start'?)")
    assert misfit("strategy", Called) == ""
