"""Checks of what rules and network models return. Each complaint names the plug-in."""

from __future__ import annotations

import math
from collections.abc import Iterable

from desim.errors import ModelError, class_of
from desim.ports import LimitsReach, NetworkModel, Rule

Plugin = Rule | NetworkModel


def checked_delay(plugin: Plugin, does: str, delay_ns: object) -> int:
    """``delay_ns``. Raises ``ModelError`` unless it is an int >= 0."""
    if type(delay_ns) is not int or delay_ns < 0:
        raise ModelError(f"{class_of(plugin)} {does} {delay_ns!r}; wanted: an int >= 0 of "
                         "nanoseconds")
    return delay_ns


def arrival_of(model: NetworkModel, delay_ns: object) -> int:
    """The delay that a model's ``send`` returned. Raises ``ModelError`` unless it is one."""
    return checked_delay(model, "delivers after", delay_ns)


def check_packets(plugin: Plugin, packets: Iterable[object], segments: int) -> None:
    """Raises ``ModelError`` unless ``packets`` are numbers of a train of ``segments``."""
    if not all(type(number) is int and 0 <= number < segments for number in packets):
        raise ModelError(f"{class_of(plugin)} dropped the packets {packets!r} of a train of "
                         f"{segments}; wanted: ints from 0 to {segments - 1}")


def undeclared(plugin: Plugin, reason: str) -> ModelError:
    """The error about a reason that the plug-in's class does not declare."""
    return ModelError(f"{class_of(plugin)} dropped for {reason!r}, which its class does not "
                      f"declare (reasons = {plugin.reasons!r})")


def reach_m_of(part: Plugin) -> float:
    """The distance in m beyond which a rule or a model lets no frame get; infinity if it does not
    say. Raises ``ModelError`` if that is no distance."""
    reach_m = part.reach_m if isinstance(part, LimitsReach) else math.inf
    if not isinstance(reach_m, float | int) or not reach_m >= 0:
        raise ModelError(f"{class_of(part)} has reach_m = {reach_m!r}; wanted: a number of metres "
                         ">= 0")
    return reach_m
