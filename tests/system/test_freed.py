"""After a run all of its objects are freed: a worker of a campaign makes many."""

import gc
from weakref import ref

from runs import HELLO, built

from desim.robot.navigation import global_planner


def what_stays():
    """The graph of a run, None if it is gone; all of the run hangs together with it."""
    simulation = built(HELLO, "stop.elapsed=10 s")
    graph = ref(simulation.graph)
    simulation.run()
    del simulation
    gc.collect()
    return graph()


def test_nothing_stays():
    assert what_stays() is None


def test_a_search_that_is_remembered_may_hold_a_whole_run(monkeypatch):
    """The twin: the planners' arrays, which outlive the run, refer to a costmap of it."""
    monkeypatch.setattr(global_planner, "ref", lambda costmap: costmap)
    global_planner._arrays.cache_clear()
    assert what_stays() is not None
    global_planner._arrays.cache_clear()
