"""Checks of tasks: does a class keep its contract?"""

from __future__ import annotations

import json
from collections.abc import Mapping

from desim.ports.tasks import Briefs, JudgesMap, Measures, Task, TaskTraits
from desim.scenario.schema.experiment import QUANTITIES
from desim.testing.advice import PluginClass, check_form, made, need
from desim.testing.checks import own_streams
from desim.testing.task_bench import TaskBench
from desim.units import NS_PER_S

_STEPS = 16


def check_task(cls: PluginClass[Task], **params: object) -> None:
    """Check a ``ports.tasks.Task``: two robots drive through a hall and learn it row by row, a
    third one without software stands. The metrics and quantities must be what JSON and samples can
    hold, from the first instant on, the briefing must be what is declared and stay, and the same
    must come out again."""
    check_form("task", cls, params)
    with own_streams(cls):
        played = [_play(cls, params) for _ in range(2)]
    need(played[0] == played[1], cls, "come to the same result in the same situation: keep state "
                                      "in self, and iterate over no set")


def _play(cls: PluginClass[Task], params: dict[str, object]) -> list[object]:
    task = made(cls, params)
    bench = TaskBench(task)
    briefing = task.briefing() if isinstance(task, Briefs) else None
    gives = TaskTraits.of(cls).gives
    need(isinstance(briefing, gives), cls,
         f"declare traits = TaskTraits(gives={type(briefing).__name__}), the class of its "
         f"briefing, not {gives.__name__}")
    before, seen = repr(briefing), [_looked(cls, task)]
    for step in range(1, _STEPS + 1):
        bench.move(0, 2.0 * step - 1.0, 4.0)
        bench.move(2, 28.0, 2.0 * step - 1.0)
        bench.learn(step % 2, 64 * step // _STEPS)
        bench.run(step * NS_PER_S)
        seen.append(_looked(cls, task))
        if isinstance(task, JudgesMap):
            need(task.judged() in (None, 0, 1), cls,
                 f"judge a place among explorers or None, not {task.judged()!r}")
    after = task.briefing() if isinstance(task, Briefs) else None
    need(repr(after) == before, cls, "leave its briefing as it was at the start")
    return [seen, bench.rows, bench.reason, before]


def _looked(cls: PluginClass[Task], task: Task) -> str:
    """The metrics and quantities as of now."""
    metrics = task.metrics()
    try:
        text = json.dumps(metrics, allow_nan=False)
    except (TypeError, ValueError) as error:
        need(False, cls, "return metrics that JSON can hold: finite numbers, words, None, lists "
                         f"and mappings of them, not {metrics!r} ({error})")
    general = set(task.leads) <= {*QUANTITIES}
    need(isinstance(metrics, Mapping) and (metrics or general), cls,
         "return some metrics by their names")
    need(general or set(task.leads) <= set(metrics), cls,
         f"lead with some of its metrics, {', '.join(metrics)}, not with {', '.join(task.leads)}")
    declared = TaskTraits.of(cls).quantities
    measured = dict(task.measure()) if isinstance(task, Measures) else {}
    need(tuple(measured) == declared, cls,
         f"measure the quantities that its traits declare, {declared}, not {tuple(measured)}")
    need(all(type(value) in (int, float) for value in measured.values()), cls,
         f"measure numbers, not {measured}")
    return text + repr(measured)
