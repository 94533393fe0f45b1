"""The key figures of a run in the head of its replay."""

from __future__ import annotations

from desim.monitor.coverage import EXPLORED
from desim.results.seal import Json
from desim.scenario.schema.scenario import Scenario


def facts(scenario: Scenario, metrics: Json, robots: int) -> list[tuple[str, str]]:
    """Label and value of each figure, the most telling first. A failed run has no ``metrics``."""
    if "imported_from" in metrics:
        counted = metrics["messages_delivered"] or metrics["messages_dropped"]
        messages = [("messages", f"{metrics['messages_delivered']:,} delivered")]
        return [("imported from", metrics["imported_from"]), ("robots", str(robots)),
                ("driven", f"{metrics['exploration_cost_m']:,.0f} m"),
                *(messages if counted else [])]
    media = ", ".join(f"{name} ({medium.model})" for name, medium in scenario.network.media.items()
                      if medium is not None)
    size = ("robots", str(robots))
    return [*([*_measured(metrics)[:1], size, *_measured(metrics)[1:]] if metrics else [size]),
            ("medium", media), ("middleware", scenario.middleware.model),
            ("strategy", scenario.coordination.strategy)]


def _measured(metrics: Json) -> list[tuple[str, str]]:
    time_s = metrics["exploration_time_s"]
    known = f"> {metrics['simulated_s']:.1f} s" if time_s is None else f"{time_s:.1f} s"
    found = [(f"{EXPLORED:.0%} explored", known),
             ("driven", f"{metrics['exploration_cost_m']:,.0f} m"),
             ("collisions", str(metrics["collisions"])),
             ("messages", f"{metrics['messages_delivered']:,} delivered")]
    for name, count in (("lost", sum(metrics["messages_dropped"].values())),
                        ("late", metrics["messages_late"])):
        if count:
            found.append((name, f"{count:,}"))
    return found
