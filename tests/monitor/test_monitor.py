"""The monitor on a made-up fleet: when it stops a run, what it samples, what it writes down."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from desim.engine.kernel import Kernel, Phase
from desim.engine.streams import Streams
from desim.engine.trace import Names, Trace, real
from desim.errors import InputError, ModelError
from desim.middleware.direct import Direct
from desim.middleware.graph import Graph
from desim.middleware.node import Node
from desim.monitor.meters.meter import Second
from desim.monitor.meters.partitions import Partitions, components
from desim.monitor.monitor import Monitor
from desim.monitor.periods import Periods
from desim.monitor.summary import robots_table, samples_table, summarize
from desim.monitor.tasks.exploration import Exploration
from desim.monitor.traffic import family, kind
from desim.monitor.truth import Truth
from desim.network.medium import Medium
from desim.ports import GridSpec
from desim.ports.tasks import Ground
from desim.robot.mapping.tiles import FREE, Layer, TilePool
from desim.scenario.schema.scenario import Scenario
from netmodels.ideal import Ideal
from netmodels.rules.partition import Partition
from netmodels.rules.range import Range

S = 1_000_000_000
GRID = GridSpec(1.0, 32, 32, 0.0, 0.0)  # one tile; all of it free: 1024 cells
TILE_0 = np.array([0], np.int32)


def within(range_m: float) -> Range:
    return Range(Range.Params(distance=f"{range_m} m"))


class Fleet:
    """Robots that stand where they are put and learn so many cells when they are told to."""

    def __init__(self, names: tuple[str, ...] = ("robot_0", "robot_1"), rules=(), passive=(),
                 middleware=Direct, **scenario) -> None:
        self.kernel, self.names, self.rows = Kernel(), Names(), []
        self.trace = Trace(self.names, self.rows.append)
        self.poses = np.zeros((len(names), 3))
        self.travelled_m = np.zeros(len(names))
        self.scenario = Scenario(name="test", **scenario)
        graph = Graph(self.kernel, self.names, self.trace, Streams(0), middleware(), names)
        graph.attach(Medium("air", Ideal(Ideal.Params()), rules, kernel=self.kernel,
                            names=self.names, streams=Streams(0), hosts=names, place=self))
        graph.start()
        self.graph = graph
        explorers = tuple(name for name in names if name not in passive)
        truth = Truth(
            self.kernel, self.trace, self.scenario, names, explorers,
            Ground(GRID, np.zeros((32, 32), np.uint8), np.ones((32, 32), bool)), graph,
            lambda: self.poses, lambda: self.travelled_m)
        self.monitor = Monitor(truth, Exploration(Exploration.Params()), Streams(0))
        self.maps = {name: SimpleNamespace(fused=np.zeros((1, 1024), np.int16), observers=[],
                                           tile_version=np.zeros(1, np.int64),
                                           row_version=np.zeros((1, 32), np.int32),
                                              received={}, own=Layer(TilePool(2), TILE_0))
                        for name in explorers}
        for name, robot_map in self.maps.items():
            self.monitor.watch(name, robot_map)

    def positions(self, time_ns: int) -> np.ndarray:
        return self.poses[:, :2]

    def at(self, time_s: float, do, phase: Phase = Phase.CONTROL) -> None:
        self.kernel.at(round(time_s * S), phase, 1, lambda _: do())

    def learn(self, time_s: float, robot: str, cells: int) -> None:
        """From ``time_s`` on ``robot`` knows the first ``cells`` cells."""
        def now() -> None:
            robot_map = self.maps[robot]
            robot_map.fused[0, :cells] = FREE
            robot_map.fused[0, cells:] = 0
            for observer in robot_map.observers:
                observer(np.array([0], np.int32))

        self.at(time_s, now)

    def run(self, until_s: int = 100) -> dict:
        self.kernel.run(until_s * S)
        self.monitor.finish()
        self.trace.flush()
        return summarize(self.monitor, self.kernel.now_ns)

    def recorded(self, kind_: str) -> list[tuple]:
        rows = np.concatenate(self.rows)
        return rows[rows["kind"] == self.names.id(kind_)][["t_ns", "a", "b", "c"]].tolist()


def test_the_run_ends_in_the_instant_in_which_a_robot_knows_99_percent():
    fleet = Fleet()
    fleet.learn(3.0, "robot_1", 1013)  # 98.9 %
    fleet.learn(7.25, "robot_1", 1014)  # the fewest that make 99 % of 1024
    fleet.learn(9.0, "robot_0", 1024)
    summary = fleet.run()
    assert fleet.kernel.now_ns == 7.25 * S
    assert summary["stop_reason"] == "explored"
    assert summary["judged_robot"] == "robot_1"
    assert (summary["exploration_time_s"], summary["union_time_s"], summary["fleet_time_s"],
            summary["censored"]) == (7.25, 7.25, None, False)
    assert summary["explored_area_m2"] == 1014.0


class Informed(Direct):
    """Publishers have to hear of who subscribes."""

    informed = "publisher"


def test_links_are_kept_where_hosts_have_beliefs_of_each_other():
    assert Fleet().monitor.links is None
    assert Fleet(middleware=Informed).monitor.links is not None


def test_what_a_task_does_every_second_is_a_function_of_its_context():
    with pytest.raises(ModelError, match=r"^a callback is a function of \(context\), not 'f'$"):
        Fleet().monitor._view.every(S, "f")


def test_to_finish_a_run_twice_changes_nothing():
    fleet = Fleet()
    fleet.learn(3.0, "robot_1", 500)
    once = fleet.run(10)
    rows, samples = len(np.concatenate(fleet.rows)), samples_table(fleet.monitor)
    assert fleet.run(10) == once
    assert len(np.concatenate(fleet.rows)) == rows and samples_table(fleet.monitor) == samples


def test_the_clock_starts_when_the_first_robot_starts():
    """The paper, 3.3.1: what happens before is nobody's time."""
    late = Fleet()
    late.monitor._started_ns = None
    late.at(2.0, lambda: late.monitor.watch("robot_1", late.maps["robot_1"]))
    late.at(3.0, lambda: late.monitor.watch("robot_0", late.maps["robot_0"]))
    late.learn(7.25, "robot_1", 1024)
    assert late.run()["exploration_time_s"] == 5.25


@pytest.mark.parametrize("by, end_s", [("any", 4.0), ("union", 2.0), ("all", 6.0)])
def test_whose_knowledge_ends_the_run(by, end_s):
    fleet = Fleet(stop={"by": by, "explored": 0.5})
    fleet.learn(1.0, "robot_0", 500)

    def other_half() -> None:
        robot_map = fleet.maps["robot_1"]
        robot_map.fused[0, 500:520] = FREE
        robot_map.observers[0](np.array([0], np.int32))

    fleet.at(2.0, other_half)
    fleet.learn(4.0, "robot_0", 512)
    fleet.learn(6.0, "robot_1", 512)
    assert fleet.run()["simulated_s"] == end_s


def test_a_run_that_reaches_the_time_limit_is_censored():
    fleet = Fleet()
    fleet.learn(3.0, "robot_0", 400)
    summary = fleet.run(20)
    assert (summary["stop_reason"], summary["simulated_s"]) == ("elapsed", 20.0)
    assert summary["censored"] and summary["exploration_time_s"] is None
    assert summary["judged_robot"] == "robot_0"
    assert summary["map_completeness"] == 400 / 1024


def test_a_condition_is_looked_at_when_something_happens_and_at_samples():
    at_event = Fleet(stop={"when": "collisions >= 2"})
    for time_s in (2.125, 3.375):
        at_event.at(time_s, lambda: at_event.monitor.incidents.collided(0, 1), Phase.WORLD)
    assert at_event.run()["simulated_s"] == 3.375
    at_sample = Fleet(stop={"when": "distance_m > 3 and explored < 0.5"}, measure={"every": "2 s"})
    at_sample.at(2.5, lambda: at_sample.travelled_m.__iadd__(2.0), Phase.WORLD)
    summary = at_sample.run()
    assert summary["simulated_s"] == 4.0
    assert summary["stop_reason"] == "condition: distance_m > 3 and explored < 0.5"


def test_a_condition_that_divides_by_zero_is_not_yet_true():
    fleet = Fleet(stop={"when": "not distance_m / collisions > 5"})
    fleet.at(2.5, lambda: fleet.travelled_m.__iadd__(4.0), Phase.WORLD)
    fleet.at(3.5, lambda: fleet.monitor.incidents.collided(0, -1), Phase.WORLD)
    fleet.at(4.5, lambda: fleet.monitor.incidents.collided(1, -1), Phase.WORLD)
    assert fleet.run()["simulated_s"] == 4.5


def test_an_unknown_quantity_is_refused():
    with pytest.raises(InputError, match="explord.*did you mean 'explored'"):
        Fleet(stop={"when": "explord > 0.5"})


def test_samples_are_periodic_and_at_the_events_asked_for():
    fleet = Fleet(measure={"every": "4 s", "on": ["explored_10pct", "recovery"]})
    fleet.learn(1.5, "robot_0", 110)  # 10.7 %
    fleet.learn(2.0, "robot_0", 120)  # 11.7 %: no new ten percent
    fleet.at(5.0, lambda: Node(fleet.monitor.truth.graph.host("robot_1"), "any").record("recovery"))
    fleet.learn(5.0, "robot_1", 310)
    fleet.at(6.0, lambda: fleet.monitor.incidents.collided(0, -1))  # not asked for
    summary = fleet.run(9)
    assert summary["robots"]["robot_1"]["recoveries"] == summary["recoveries"] == 1
    table = samples_table(fleet.monitor)
    assert list(zip(table["time_s"], table["cause"], strict=True)) == [
        (0.0, "period"), (1.5, "explored_10pct"), (4.0, "period"),
        (5.0, "recovery+explored_10pct"), (8.0, "period"), (9.0, "end")]
    assert table["recoveries"] == [0, 0, 0, 1, 1, 1]
    assert table["collisions"] == [0, 0, 0, 0, 1, 1]


def test_a_condition_causes_a_sample_when_it_becomes_true():
    fleet = Fleet(measure={"every": "4 s", "when": ["explored > 0.5", "collisions > 1"]})
    fleet.learn(1.5, "robot_0", 600)
    fleet.learn(2.5, "robot_0", 700)  # still true
    fleet.learn(3.0, "robot_0", 500)  # no more, which is noticed at 4.0
    fleet.learn(5.0, "robot_1", 800)
    fleet.at(6.0, lambda: fleet.monitor.incidents.collided(0, 1))
    fleet.at(8.0, lambda: fleet.monitor.incidents.collided(0, 1), Phase.WORLD)
    fleet.run(9)
    table = samples_table(fleet.monitor)
    assert list(zip(table["time_s"], table["cause"], strict=True)) == [
        (0.0, "period"), (1.5, "explored > 0.5"), (4.0, "period"), (5.0, "explored > 0.5"),
        (8.0, "period+collisions > 1"), (9.0, "end")]


def test_a_measurement_may_have_its_own_period():
    """At its own instants; where a sample has another cause than the time, all are taken."""
    fleet = Fleet(measure={"every": "4 s", "when": ["collisions > 0"], "periods": {
        "explored": "3 s", "distance_m": "8 s", "robots": "5 s"}})
    fleet.learn(1.0, "robot_0", 512)
    fleet.at(6.5, lambda: fleet.monitor.incidents.collided(0, -1))
    fleet.run(10)
    table = samples_table(fleet.monitor)
    assert list(zip(table["time_s"], table["cause"], table["explored"], table["collisions"],
                    table["distance_m"], strict=True)) == [
        (0.0, "period", 0.0, 0, 0.0), (3.0, "period", 0.5, None, None),
        (4.0, "period", None, 0, None), (6.0, "period", 0.5, None, None),
        (6.5, "collisions > 0", 0.5, 1, 0.0), (8.0, "period", None, 1, 0.0),
        (9.0, "period", 0.5, None, None), (10.0, "end", 0.5, 1, 0.0)]
    assert robots_table(fleet.monitor)["time_s"].tolist() == [0, 0, 5, 5, 10, 10]


@given(every=st.integers(1, 50), own=st.dictionaries(st.sampled_from("abc"), st.integers(1, 50)))
def test_something_is_due_at_each_instant_and_nothing_between(every, own):
    periods, now = Periods(every, own), 0
    for _ in range(20):
        due = {name for name in "abcd" if periods.due(now)(name)}
        assert due == {name for name in "abcd" if now % own.get(name, every) == 0}
        following = periods.next_ns(now)
        assert not any(instant % period == 0 for period in (every, *own.values())
                       for instant in range(now + 1, following))
        now = following


def test_a_cost_is_an_expression():
    """Equations 1 and 2 with another cost; those of the paper are there, too."""
    found = {}
    for cost in ("distance_m", "5 * robots + 0.5 * distance_m + time_s", "distance_m / collisions"):
        fleet = Fleet(measure={"cost": cost})
        fleet.learn(1.0, "robot_0", 600)
        fleet.at(2.0, lambda fleet=fleet: fleet.travelled_m.__iadd__(4.0), Phase.WORLD)
        summary = fleet.run(10)
        assert (summary["exploration_cost_m"], summary["exploration_efficiency_m2_per_m"]
                ) == (8.0, 75.0)
        found[cost] = summary["exploration_cost"], summary["exploration_efficiency"]
    assert list(found.values()) == [(8.0, 75.0), (24.0, 25.0), (None, None)]


def test_samples_and_poses_are_in_the_digest():
    fleet = Fleet(measure={"every": "2 s"})
    fleet.poses[1] = 1.5, -2.0, 0.25
    fleet.learn(1.0, "robot_1", 256)
    fleet.run(2)
    assert [(t, real(a), real(b), real(c)) for t, a, b, c in fleet.recorded("sample")] == [
        (0, 0.0, 0.0, 0.0), (2 * S, 0.25, 0.25, 0.0), (2 * S, 0.25, 0.25, 0.0)]
    poses = [(t, real(a), real(b), real(c)) for t, a, b, c in fleet.recorded("pose")]
    assert poses == [(t, *pose) for t in (0, S, 2 * S)
                     for pose in ((0.0, 0.0, 0.0), (1.5, -2.0, 0.25))]


def test_a_stopped_host_forgets_and_starts_again_with_a_fresh_belief():
    fleet = Fleet(stop={"by": "all", "explored": 0.5})
    fleet.learn(1.0, "robot_0", 600)
    fleet.at(2.0, lambda: fleet.monitor.watch("robot_0", None))
    fleet.learn(3.0, "robot_1", 600)
    summary = fleet.run(5)
    assert summary["stop_reason"] == "elapsed"
    assert (summary["explored"], summary["explored_all"]) == (600 / 1024, 0.0)
    assert summary["judged_robot"] == "robot_1"


def test_a_passive_robot_counts_in_nothing_but_its_place():
    fleet = Fleet(("robot_0", "robot_1"), passive=("robot_1",), stop={"by": "all"},
                  rules=[within(1.0)])
    fleet.poses[1, 0] = 50.0
    fleet.learn(2.0, "robot_0", 1024)
    summary = fleet.run()
    assert (summary["simulated_s"], summary["fleet_time_s"]) == (2.0, 2.0)
    assert summary["partitions"]["count"] == 0
    assert summary["robots"]["robot_1"]["explored"] is None
    table = robots_table(fleet.monitor)
    assert table["robot"] == ["robot_0", "robot_1"] * 3
    assert table["x_m"].tolist() == [0.0, 50.0] * 3
    assert np.isnan(table["explored"]).tolist() == [False, True] * 3


def test_moving_robots_are_counted_by_the_second():
    fleet = Fleet(measure={"every": "3 s"})
    fleet.at(2.5, lambda: fleet.travelled_m.__setitem__(0, 0.5), Phase.WORLD)
    fleet.at(5.5, lambda: fleet.travelled_m.__setitem__(0, 0.54), Phase.WORLD)
    fleet.run(6)
    assert samples_table(fleet.monitor)["robots_moving"] == [0, 1, 0, 0]


# ---------------------------------------------------------------------------------- partitions


def test_components_of_a_chain():
    x_m = np.array([0.0, 3.0, 7.0, 30.0, 33.0])
    apart_m = abs(x_m[:, None] - x_m)
    assert [components(apart_m <= reach_m) for reach_m in (2.9, 3.0, 4.0, 23.0)] == [5, 3, 2, 1]


def test_partition_episodes_have_a_beginning_and_an_end():
    near, far, began = np.ones((2, 2), bool), np.eye(2, dtype=bool), []
    partitions = Partitions(lambda parts: began.append((t, parts)))
    for t, linked in enumerate([near, far, far, near, far]):
        partitions.each_second(Second(t * S, np.empty(0), np.empty(0), linked))
    assert began == [(1, 2), (4, 2)]
    assert partitions.summary(6 * S)["partitions"] == {
        "count": 2, "total_s": 4.0, "longest_s": 2.0, "most_parts": 2,
        "episodes_s": [[1.0, 3.0], [4.0, 6.0]]}


def test_the_monitor_counts_partitions_once_a_second():
    fleet = Fleet(rules=[within(10.0)], measure={"every": "2 s", "on": ["partition"]})
    fleet.at(1.5, lambda: fleet.poses.__setitem__((1, 0), 12.0), Phase.WORLD)
    fleet.at(4.5, lambda: fleet.poses.__setitem__((1, 0), 8.0), Phase.WORLD)
    assert fleet.run(7)["partitions"] == {"count": 1, "total_s": 3.0, "longest_s": 3.0,
                                          "most_parts": 2, "episodes_s": [[2.0, 5.0]]}
    table = samples_table(fleet.monitor)
    assert list(zip(table["time_s"], table["cause"], table["parts"], strict=True)) == [
        (0.0, "period", 1), (2.0, "period", 2), (2.0, "partition", 2), (4.0, "period", 2),
        (6.0, "period", 1), (7.0, "end", 1)]
    assert fleet.recorded("partition") == [(2 * S, 2, 0, 0)]


def test_a_stopped_robot_is_no_part_and_no_link_of_a_chain():
    fleet = Fleet(("robot_0", "robot_1", "robot_2"), rules=[within(10.0)])
    fleet.poses[:, 0] = 0.0, 8.0, 16.0
    fleet.at(1.5, fleet.graph.host("robot_1").stop)  # the middle of the chain
    fleet.at(3.5, fleet.graph.host("robot_2").stop)  # robot_0 is alone now, and whole
    assert fleet.run(6)["partitions"]["episodes_s"] == [[2.0, 4.0]]


def test_a_rule_that_separates_hosts_splits_the_fleet_while_it_holds():
    rule = Partition(Partition.Params(groups=[["robot_0"]], **{"from": "1500 ms",
                                                               "until": "4 s"}))
    fleet = Fleet(("robot_0", "robot_1", "robot_2"), rules=[within(10.0), rule])
    assert fleet.run(6)["partitions"] == {"count": 1, "total_s": 2.0, "longest_s": 2.0,
                                          "most_parts": 2, "episodes_s": [[2.0, 4.0]]}


def test_without_a_range_nobody_is_ever_cut_off():
    fleet = Fleet()
    fleet.poses[1, 0] = 1e9
    assert fleet.run(2)["partitions"]["count"] == 0


# ------------------------------------------------------------------------------------- traffic


@pytest.mark.parametrize("topic, its_family, its_kind", [
    ("/robot_3/scan", "/*/scan", "simulation"),
    ("/robot_12/cmd_vel", "/*/cmd_vel", "simulation"),
    ("/map_exchange/robot_3", "/map_exchange/*", "coordination"),
    ("/robot_3/explored_map", "/*/explored_map", "monitoring"),
    ("/robot_3/team_state", "/*/team_state", "coordination"),
    ("/robot_3/strategy/bid", "/*/strategy/bid", "coordination"),
])
def test_topics_by_family_and_kind(topic, its_family, its_kind):
    assert family(topic, frozenset({"robot_3", "robot_12"})) == its_family
    assert kind(topic) == its_kind
