"""Doubts about a scenario that is right: whether its author meant what it says."""

from __future__ import annotations

from collections.abc import Iterator

from desim.ports import TimeWindow
from desim.scenario.plugin_choices import chosen
from desim.scenario.schema.scenario import Scenario
from desim.scenario.source_places import Places
from desim.units import DURATION


def too_late(scenario: Scenario) -> list[str]:
    """Warnings of rules, background traffic and faults that would begin when the run is over."""
    end_ns = scenario.stop.elapsed_ns
    return [f"{key}: {DURATION.format(begin_ns)} is no earlier than the end of the run, "
            f"{DURATION.format(end_ns)} (stop.elapsed): it never happens"
            for key, begin_ns in _beginnings(scenario) if begin_ns >= end_ns]


def _beginnings(scenario: Scenario) -> Iterator[tuple[str, int]]:
    for path, choice in chosen(scenario.network, "network"):
        if isinstance(choice.params, TimeWindow):
            yield f"{path}.from", choice.params.start_ns
    for i, flow in enumerate(scenario.network.background):
        yield f"network.background.{i}.from", flow.start_ns
    for i, fault in enumerate(scenario.faults):
        yield f"faults.{i}.at", fault.at_ns


def media_beside(scenario: Scenario, places: Places) -> list[str]:
    """A note of the media that stay where ``--set`` has added others."""
    added = {name: places.key(("network", "media", name)).source.startswith("--set ")
             for name in scenario.network.media}
    stay = [name for name, new in added.items() if not new]
    if not stay or not any(added.values()):
        return []
    listed = ", ".join(f"{name} ({scenario.network.media[name].model}, "
                       f"{places.key(('network', 'media', name))})" for name in stay)
    return [f"network.media still has {listed}, beside what --set adds; --set "
            f"network.media.{stay[0]}=null takes it away"]
