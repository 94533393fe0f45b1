"""A stepped run is the ordinary run: the same digest, whenever its caller looks."""

import threading
from functools import cache

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from runs import HELLO, ROUGH, built

import desim
from desim.errors import InputError, ModelError
from desim.ports import Place
from desim.stepping import ControlPeriods, Goals, Stepper, Turns
from desim.units import NS_PER_S

CASES = {"hello": (HELLO, "stop.elapsed=12 s"), "everything at once": (ROUGH, "stop.elapsed=12 s"),
         "strategies that speak": (HELLO, "stop.elapsed=12 s", "coordination.strategy=market")}
STEPS = st.lists(st.tuples(st.booleans(), st.integers(0, 2 * NS_PER_S)), min_size=1, max_size=20)


@cache
def unstepped(case):
    outcome = built(*CASES[case]).run()
    return outcome.digest, outcome.events, outcome.stop_reason, outcome.simulated_ns


def stepped(case, steps, observe=lambda run: None, decide=lambda decision: None, cls=Stepper):
    """The outcome of a run of these steps, and then from decision to decision."""
    file, *overrides = CASES[case]
    with cls(file, overrides=overrides) as run:
        for to_decision, for_ns in steps:
            until_ns = run.now_ns + for_ns
            if not to_decision:
                run.step_to(until_ns)
            elif (decision := run.next_decision(until_ns)) is not None:
                decide(decision)
            observe(run)
        while (decision := run.next_decision()) is not None:
            decide(decision)
        outcome = run.finish()
    return outcome.digest, outcome.events, outcome.stop_reason, outcome.simulated_ns


def observe(run):
    for context in run.robots.values():
        assert context.occupancy().shape == (context.grid.height, context.grid.width)
        assert context.pose is None or context.pose.yaw_rad < 4
        assert all(peer.heard_ns <= run.now_ns for peer in context.peers.values())


@settings(max_examples=8, deadline=None)
@given(steps=STEPS)
@pytest.mark.parametrize("case", CASES)
def test_random_steps_give_the_digest_of_an_uninterrupted_run(case, steps):
    assert stepped(case, steps, observe) == unstepped(case)


def test_decisions_of_the_scenarios_own_strategy_give_its_digest():
    decided = []

    def own(decision):
        decided.append(decision.robot)
        decision.choose(decision.own())

    assert stepped("hello", [], decide=own) == unstepped("hello")
    assert sorted(set(decided)) == ["robot_0", "robot_1", "robot_2"]


def test_other_decisions_give_another_digest():
    def last(decision):
        frontiers = decision.context.frontiers()
        decision.choose(frontiers[-1] if frontiers else None)

    assert stepped("hello", [], decide=last)[0] != unstepped("hello")[0]


class Sampling(Stepper):
    """A twin: each step is closed as the run is, with a last sample."""

    def _step(self, until_ns):
        super()._step(until_ns)
        self.simulation.monitor.quantities()
        self.simulation.monitor._sample("end")


def test_the_property_notices_a_step_that_leaves_a_trace():
    assert stepped("hello", [(False, NS_PER_S)], cls=Sampling)[0] != unstepped("hello")[0]


def test_a_search_of_another_robots_map_changes_it():
    def search(run):
        for context in run.robots.values():
            if context.pose is not None:
                context.frontiers()

    assert stepped("hello", [(False, NS_PER_S // 10)] * 100, search)[0] != unstepped("hello")[0]


def test_a_decision_is_taken_at_the_next_step():
    with desim.Stepper(HELLO) as run:
        decision = run.next_decision()
        now_ns, context = run.now_ns, decision.context
        goal = context.frontiers()[-1]
        decision.choose(goal)
        assert context.goal is None
        run.step_to(now_ns)
        assert (run.now_ns, context.goal) == (now_ns, Place(*goal[:2]))


def test_turns_come_every_period_at_phases_of_their_own():
    with Stepper(HELLO, Turns(NS_PER_S // 2)) as run:
        times = {}
        while (turn := run.next_decision(3 * NS_PER_S)) is not None:
            times.setdefault(turn.robot, []).append(run.now_ns)
    assert [len(own) for own in times.values()] == [6, 6, 6]
    assert all(b - a == NS_PER_S // 2 for own in times.values()
               for a, b in zip(own, own[1:], strict=False))
    assert len({own[0] for own in times.values()}) == 3


def test_turns_at_which_nobody_acts_change_no_way_of_a_robot():
    def goals(decisions):
        with Stepper(HELLO, decisions) as run:
            run.step_to(8 * NS_PER_S)
            return [context.goal for context in run.robots.values()]

    assert goals(Turns(NS_PER_S)) == goals(Goals())
    assert goals(ControlPeriods(NS_PER_S)) == [None] * 3


def test_the_second_thread_ends_with_the_run():
    before = threading.active_count()
    run = Stepper(HELLO)
    run.next_decision()
    assert threading.active_count() == before + 1
    run.close()
    run.close()
    assert threading.active_count() == before
    assert run.is_over and run.next_decision() is None


def test_an_error_of_the_run_is_the_callers_and_ends_it():
    with Stepper(HELLO) as run:
        run.next_decision().choose("there")
        with pytest.raises(ModelError, match="chose 'there'; wanted: one of frontiers") as caught:
            run.next_decision()
        assert "(robot_" in caught.value.__notes__[-1]
        assert run.is_over and run.next_decision() is None


@pytest.mark.parametrize("time_ns", [1.5, -1, 10])
def test_time_does_not_go_back(time_ns):
    with Stepper(HELLO) as run:
        run.step_to(NS_PER_S)
        with pytest.raises(InputError, match="a step goes to an int of ns, 1000000000 or later"):
            run.step_to(time_ns)


def test_ctrl_c_reaches_the_caller_and_the_run_can_go_on():
    class Interrupted:
        """A lock; at the first wait for it Ctrl-C is pressed."""

        def __init__(self, lock):
            self.lock, self.pressed, self.release = lock, False, lock.release

        def acquire(self):
            if not self.pressed:
                self.pressed = True
                raise KeyboardInterrupt
            self.lock.acquire()

    with Stepper(HELLO, overrides=["stop.elapsed=12 s"]) as run:
        run._baton._outer = Interrupted(run._baton._outer)
        with pytest.raises(KeyboardInterrupt):
            run.step_to(12 * NS_PER_S)
        assert run.now_ns < 12 * NS_PER_S
        outcome = run.step_to(12 * NS_PER_S) or run.finish()
    assert outcome.digest == unstepped("hello")[0]
