"""Traffic on cells: no two robots in one, none change places, and PIBT's theorem."""

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from desim.robot.coordination.strategies.pibt import PibtTraffic
from desim.robot.coordination.strategies.prioritized import PrioritizedTraffic
from desim.robot.coordination.traffic import planners
from desim.robot.coordination.traffic.cells import CellGraph, cells_of
from desim.robot.coordination.traffic.planners import Pibt, Prioritized
from desim.robot.coordination.traffic.schedule import CellVisit, Schedule
from desim.testing import StrategyBench, check_strategy


def pibt():
    return Pibt(np.random.default_rng(1))


def graph_of(*rows):
    """Of rows as of a MovingAI map: . free, @ blocked."""
    cells = {(x, y) for y, row in enumerate(rows) for x, letter in enumerate(row) if letter == "."}
    return CellGraph({(x, y): tuple(one for one in ((x + 1, y), (x, y + 1), (x - 1, y), (x, y - 1))
                                    if one in cells) for x, y in sorted(cells)})


def diameter(graph):
    return max(max(graph.steps_to(cell).values()) for cell in graph.edges)


def is_biconnected(graph):
    """Connected, and connected without any one of its cells."""
    def is_connected(without):
        cells = [cell for cell in graph.edges if cell != without]
        seen, stack = {cells[0]}, [cells[0]]
        while stack:
            for one in graph.edges[stack.pop()]:
                if one != without and one not in seen:
                    seen.add(one)
                    stack.append(one)
        return len(seen) == len(cells)

    return all(map(is_connected, (None, *graph.edges)))


def no_conflict(graph, at, then):
    """Whether all go to cells beside, no two to one, and no two change places."""
    by_way = {(at[name], then[name]) for name in at}
    return (len(set(then.values())) == len(at) and set(then) == set(at)
            and all(then[name] == at[name] or then[name] in graph.edges[at[name]] for name in at)
            and not any(a != b and (b, a) in by_way for a, b in by_way))


def steps_until_all_were_there(planner, graph, at, goals, most):
    """The number of steps after which each robot has been at its goal, None if not by ``most``."""
    seen = {name for name in at if at[name] == goals[name]}
    for step in range(most + 1):
        if len(seen) == len(at):
            return step
        then = planner.step(graph, at, goals)
        assert no_conflict(graph, at, then)
        at = then
        seen |= {name for name in at if at[name] == goals[name]}
    return None


MAPS = {"empty": ["......"] * 5,
        "room": ["........", ".@@..@@.", ".@....@.", "........", ".@....@.", ".@@..@@.",
                 "........"],
        "warehouse": [".........", ".@@@.@@@.", ".........", ".@@@.@@@.", "........."],
        "ring": ["....", ".@@.", ".@@.", "...."]}


@st.composite
def fleets(draw, graph, most):
    count = draw(st.integers(1, most))
    starts, goals = (draw(st.permutations(sorted(graph.edges)))[:count] for _ in range(2))
    names = [f"r{k}" for k in range(count)]
    return dict(zip(names, starts, strict=True)), dict(zip(names, goals, strict=True))


@pytest.mark.parametrize("name", MAPS)
@settings(max_examples=30, deadline=None)
@given(data=st.data())
def test_by_pibt_all_get_to_their_goals_where_the_graph_is_biconnected(name, data):
    """Theorem 1: in at most the diameter times the number of robots steps, with one cell free."""
    graph = graph_of(*MAPS[name])
    assert is_biconnected(graph)
    at, goals = data.draw(fleets(graph, len(graph.edges) - 1))
    most = diameter(graph) * len(at)
    assert steps_until_all_were_there(pibt(), graph, at, goals, most) is not None


@settings(max_examples=60, deadline=None)
@given(rows=st.lists(st.text(".@", min_size=5, max_size=5), min_size=3, max_size=6),
       data=st.data())
def test_no_two_in_a_cell_and_none_change_places_on_any_map(rows, data):
    graph = graph_of(*rows)
    assume(len(graph.edges) >= 2)
    at, goals = data.draw(fleets(graph, len(graph.edges)))
    for planner in (pibt(), Prioritized()):
        now = dict(at)
        for _ in range(12):
            then = planner.step(graph, now, goals)
            assert no_conflict(graph, now, then)
            now = then


def test_two_in_a_street_cannot_pass():
    """No cycle, no theorem: PIBT's robots stand face to face for ever, and never change places."""
    graph = graph_of("....")
    at, goals = {"a": (0, 0), "b": (3, 0)}, {"a": (3, 0), "b": (0, 0)}
    assert steps_until_all_were_there(pibt(), graph, at, goals, 100) is None


def test_without_inheritance_robots_block_each_other(monkeypatch):
    """The twin: the one that stands in the way is not pushed, and stays."""
    moves = Pibt._moves

    def selfish(self, name, pusher):
        if pusher is None:
            return moves(self, name, None)
        self._next[name] = self._at[name]
        self._taken.add(self._at[name])
        return False

    graph = graph_of(*MAPS["ring"])
    ring = [(0, 0), (1, 0), (2, 0), (3, 0), (3, 1), (3, 2), (3, 3), (2, 3), (1, 3), (0, 3), (0, 2)]
    at = {f"r{k}": cell for k, cell in enumerate(ring)}
    goals = {f"r{k}": ring[(k + 5) % len(ring)] for k in range(len(ring))}
    most = diameter(graph) * len(at)
    assert steps_until_all_were_there(pibt(), graph, at, goals, most) is not None
    monkeypatch.setattr(Pibt, "_moves", selfish)
    assert steps_until_all_were_there(pibt(), graph, at, goals, most) is None


def one_shot(graph, count, draw, planner):
    """All have to be at random goals at once: the sum of the times at which each comes to stay, and
    the last of them; None if not within 1000 steps."""
    names, cells = [f"r{k}" for k in range(count)], sorted(graph.edges)
    at, goals = (dict(zip(names, map(cells.__getitem__, draw.permutation(len(cells))[:count]),
                          strict=True)) for _ in range(2))
    came = dict.fromkeys(names, 0)
    for step in range(1000):
        away = [name for name in names if at[name] != goals[name]]
        if not away:
            return sum(came.values()), max(came.values())
        came.update(dict.fromkeys(away, step + 1))
        at = planner.step(graph, at, goals)
    return None


# The authors' program (github.com/Kei18/pibt2, faab5b9), 300 random instances on an empty map: the
# share that it solves; of those the sum of costs and the makespan, means and standard deviations.
BY_THE_AUTHORS = [(8, 16, 297 / 300, (113.6, 21.2), (12.4, 3.1)),
                  (8, 32, 280 / 300, (374.0, 102.6), (24.1, 12.6)),
                  (16, 64, 298 / 300, (964.1, 69.8), (26.4, 4.5))]


def check_one_shots(size, count, share, *figures, runs=80, make=pibt):
    """Means within four standard errors of those of the authors, the share within four, too."""
    graph, draw = graph_of(*["." * size] * size), np.random.default_rng(size * count)
    ends = [one_shot(graph, count, draw, make()) for _ in range(runs)]
    solved = [end for end in ends if end is not None]
    error = np.sqrt(max(share * (1 - share), 0.01) * (1 / runs + 1 / 300))
    assert abs(len(solved) / runs - share) <= 4 * error
    for (mean, deviation), ours in zip(figures, np.transpose(solved), strict=True):
        assert abs(ours.mean() - mean) <= 4 * deviation * np.sqrt(1 / len(solved) + 1 / 300)


@pytest.mark.parametrize("row", BY_THE_AUTHORS)
def test_one_shots_are_as_those_of_the_authors_program(row):
    check_one_shots(*row)


def test_without_chance_robots_push_each_other_for_ever():
    """The twin: of cells that are equally good, the first is always taken."""
    class Sure:
        random = staticmethod(np.zeros)

    with pytest.raises(AssertionError):
        check_one_shots(*BY_THE_AUTHORS[1], runs=20, make=lambda: Pibt(Sure()))


def test_without_reservations_robots_meet(monkeypatch):
    """The other twin: cooperative A* that sees no reservations is plain A*."""
    path = planners._path
    monkeypatch.setattr(planners, "_path", lambda graph, start, goal, reserved:
                        path(graph, start, goal, ()))
    graph = graph_of(*MAPS["empty"])
    at, goals = {"a": (0, 2), "b": (5, 2)}, {"a": (5, 2), "b": (0, 2)}
    with pytest.raises(AssertionError):
        steps_until_all_were_there(Prioritized(), graph, at, goals, 20)


@pytest.mark.parametrize("name", ["empty", "room", "warehouse"])
@settings(max_examples=20, deadline=None)
@given(data=st.data())
def test_by_reservations_few_robots_get_to_their_goals(name, data):
    graph = graph_of(*MAPS[name])
    at, goals = data.draw(fleets(graph, 4))
    assert steps_until_all_were_there(Prioritized(), graph, at, goals, 100) is not None


def test_a_reserved_way_is_gone_around():
    """Two head-on in a hall: one of them steps aside, and both lose at most two steps."""
    graph = graph_of(*MAPS["empty"])
    at, goals = {"a": (0, 2), "b": (5, 2)}, {"a": (5, 2), "b": (0, 2)}
    assert steps_until_all_were_there(Prioritized(), graph, at, goals, 7) is not None


def entered_by_a_follower(on_its_way):
    """Robot a was let go from cell 1 to 2, b stands in cell 0 and is to go to 1: whether it is
    granted that before and after a has come to 2, by a schedule that a host took up again."""
    at = [CellVisit((k, 0), (float(k), 0.0)) for k in range(3)]
    schedule = Schedule()
    schedule.resume("a", at[1], at[2] if on_its_way else at[1])
    schedule.resume("b", at[0], at[0])
    schedule.plan("b", at[1])
    before = schedule.grant()
    schedule.arrive("a", at[2].place)
    return "b" in before, "b" in schedule.grant()


def test_a_robot_that_is_taken_up_on_its_way_holds_both_cells():
    assert entered_by_a_follower(on_its_way=True) == (False, True)
    assert entered_by_a_follower(on_its_way=False) == (False, False)


def test_cells_of_a_map_are_joined_where_the_way_is_free():
    bench = StrategyBench([])
    costs = bench.costmap().copy()
    graph = cells_of(costs, bench.grid, 10.0)
    assert len(graph.edges) == 100 and len(graph.edges[5, 5]) == 4
    assert graph.centre((5, 5)) == (5.0, 5.0) and graph.nearest((4.0, 7.0)) == (5, 5)
    costs[:, 105] = 254  # a wall at x = 2.5 m to 3 m, through no centre
    cut = cells_of(costs, bench.grid, 10.0)
    assert len(cut.edges) == 100 and (4, 5) not in cut.edges[5, 5]


@pytest.mark.parametrize("cls", [PibtTraffic, PrioritizedTraffic])
def test_traffic_keeps_its_contract(cls):
    check_strategy(cls)
    check_strategy(cls, cell="10 m")
