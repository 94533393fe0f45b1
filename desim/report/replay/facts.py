"""The key figures of a run in the head of its replay."""

from __future__ import annotations

from desim.monitor.coverage import EXPLORED
from desim.plugins import bare
from desim.report.key_figures import imported_figures, task_figures, time_or_limit
from desim.results.seal import Json
from desim.scenario.schema.scenario import Scenario


def facts(scenario: Scenario, metrics: Json, robots: int) -> list[tuple[str, str]]:
    """Label and value of each figure, the most telling first. A failed run has no ``metrics``."""
    if "imported_from" in metrics:
        source, *rest = imported_figures(metrics)
        return [source, ("robots", str(robots)), *rest]
    media = ", ".join(f"{name} ({bare(medium.model)})"
                      for name, medium in scenario.network.media.items() if medium is not None)
    size = ("robots", str(robots)) if robots else ("hosts", str(len(scenario.hosts)))
    first, *rest = _measured(metrics, robots) if metrics else [size]
    return [first, *([size, *rest] if metrics else []),
            ("medium", media), ("middleware", bare(scenario.middleware.model)),
            *([("strategy", bare(scenario.coordination.strategy))] if robots else [])]


def _measured(metrics: Json, robots: int) -> list[tuple[str, str]]:
    if "exploration_time_s" in metrics:
        done = [(f"{EXPLORED:.0%} explored",
                 time_or_limit(metrics["exploration_time_s"], metrics["simulated_s"]))]
    else:
        done = task_figures(metrics)
    driven = [("driven", f"{metrics['exploration_cost_m']:,.0f} m"),
              ("collisions", str(metrics["collisions"]))] if robots else []
    found = [*done, *driven, ("messages", f"{metrics['messages_delivered']:,} delivered")]
    for name, count in (("lost", sum(metrics["messages_dropped"].values())),
                        ("late", metrics["messages_late"])):
        if count:
            found.append((name, f"{count:,}"))
    return found
