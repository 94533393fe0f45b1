"""The action dependency graph: in any order of arrivals no two are in one cell, and all arrive."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from test_traffic import MAPS, fleets, graph_of, pibt

from desim.robot.coordination.traffic.schedule import CellVisit, Schedule


def visit(graph, cell):
    return CellVisit(cell, graph.centre(cell))


def scheduled(graph, at, goals, steps):
    """A schedule of ``steps`` of PIBT's, and where it ends."""
    schedule, planner = Schedule(), pibt()
    for name, cell in at.items():
        schedule.start(name, visit(graph, cell))
    for _ in range(steps):
        then = planner.step(graph, at, goals)
        for name, cell in then.items():
            if cell != at[name]:
                schedule.plan(name, visit(graph, cell))
        at = then
    return schedule, at


def play(schedule, late):
    """Let robots arrive in an order that ``late`` draws. The cells where they come to stand."""
    stands = {}
    while True:
        schedule.grant()
        under_way = schedule.under_way()
        if not under_way:
            return stands
        cells = [seen.cell for seen in under_way.values()]
        assert len(set(cells)) == len(cells)
        for name, cell in stands.items():  # but for circles nobody stands where another one goes
            assert name in under_way or cell not in cells
        name = late(sorted(under_way))
        assert schedule.arrive(name, under_way[name].place)
        assert not schedule.arrive(name, under_way[name].place)
        stands[name] = under_way[name].cell


@pytest.mark.parametrize("name", MAPS)
@settings(max_examples=25, deadline=None)
@given(data=st.data())
def test_all_come_to_the_end_of_the_plan_in_any_order(name, data):
    graph = graph_of(*MAPS[name])
    at, goals = data.draw(fleets(graph, len(graph.edges)))
    schedule, ends = scheduled(graph, at, goals, 6)
    assert play(schedule, lambda names: data.draw(st.sampled_from(names))) == ends


def test_the_order_of_the_plan_is_kept():
    """a goes through the crossing first by the plan, and b, which is quick, waits for it."""
    graph = graph_of("@.@", "...", "@.@")
    schedule = Schedule()
    for name, *cells in (("a", (1, 0), (1, 1), (1, 2)), ("b", (0, 1), (1, 1), (2, 1))):
        schedule.start(name, visit(graph, cells[0]))
        for cell in cells[1:]:
            schedule.plan(name, visit(graph, cell))
    b_first = play(schedule, lambda names: names[-1])
    assert b_first == {"a": (1, 2), "b": (2, 1)}


def test_by_free_cells_alone_robots_stand_for_ever(monkeypatch):
    """The twin: who comes first goes first, and b stands where a has to pass."""
    graph = graph_of("....", "@.@@")

    def played():
        schedule = Schedule()
        for name, *cells in (("a", (0, 0), (1, 0), (1, 1)), ("b", (3, 0), (2, 0), (1, 0))):
            schedule.start(name, visit(graph, cells[0]))
            for cell in cells[1:]:
                schedule.plan(name, visit(graph, cell))
        return play(schedule, lambda names: names[-1])

    assert played() == {"a": (1, 1), "b": (1, 0)}

    def grant(self):
        taken = {seen.cell for seen in (*self._at.values(), *self._granted.values())}
        free = [name for name, planned in self._planned.items() if planned
                and self._at.get(name) == self._granted[name] and planned[0].cell not in taken]
        for name in free[-1:]:
            self._granted[name] = self._planned[name].popleft()
        return free[-1:]

    monkeypatch.setattr(Schedule, "grant", grant)
    assert played() != {"a": (1, 1), "b": (1, 0)}
