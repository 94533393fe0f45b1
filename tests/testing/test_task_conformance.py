"""The kit's check of tasks: ours pass, and what breaks the contract is named."""

import random
from dataclasses import replace

import pytest

from desim import plugins
from desim.monitor.tasks.exploration import Exploration
from desim.monitor.tasks.patrolling import Patrolling
from desim.ports import Place
from desim.ports.tasks import Patrol
from desim.testing import check_task

TASKS = sorted({*plugins.available("task"), "exploration", "none", "patrolling"})

# What has no default.
NEEDED = {"delivery": {"every": "3 s", "stations": {
    "shelf": {"kind": "pick", "at": ["4 m", "4 m"]},
    "dock": {"kind": "drop", "at": ["20 m", "4 m"]}}}}


@pytest.mark.parametrize("name", TASKS)
def test_every_task_keeps_its_contract(name):
    check_task(plugins.load("task", name), **NEEDED.get(name, {}))


def test_patrols_keep_it_with_given_places():
    check_task(Patrolling, places=[["5 m", "4 m"], ["28 m", "9 m"]], rounds=1, map="unknown")


class Secretive(Patrolling):
    traits = replace(Patrolling.traits, gives=type(None))


class Fickle(Patrolling):
    def briefing(self):
        return Patrol((Place(self._context.now_ns / 1e9, 0.0),))


class Vague(Exploration):
    def metrics(self):
        return {"share": float("nan")}


class Mute(Exploration):
    def metrics(self):
        return {}


class Boastful(Exploration):
    leads = ("glory",)


class Leaderless(Exploration):
    leads = ()


class Unmeasured(Patrolling):
    traits = replace(Patrolling.traits, quantities=("idleness_s",))


class Chancy(Exploration):
    leads = ("luck",)

    def metrics(self):
        return {"luck": random.random()}


class Floating(Exploration):
    def on_knowledge(self, context, explorer):
        context.record("knows", context.explorers[explorer], context.knowledge.known[0] / 2)


class Partial(Exploration):
    def judged(self):
        return "robot_1"


@pytest.mark.parametrize("cls, advice", [
    (Secretive, "declare traits = TaskTraits(gives=Patrol), the class of its briefing, not "
                "NoneType"),
    (Fickle, "leave its briefing as it was at the start"),
    (Vague, "return metrics that JSON can hold"),
    (Mute, "return some metrics by their names"),
    (Boastful, "lead with some of its metrics, censored, exploration_time_s, union_time_s, "
               "fleet_time_s, not with glory"),
    (Leaderless, "declare leads = ('...',), a tuple of names, not ()"),
    (Unmeasured, "measure the quantities that its traits declare"),
    (Chancy, "draw from context.stream(name) only"),
    (Floating, "no ints"),
    (Partial, "judge a place among explorers or None"),
])
def test_what_breaks_the_contract_is_named(cls, advice):
    with pytest.raises(AssertionError) as caught:
        check_task(cls)
    assert advice in str(caught.value)
