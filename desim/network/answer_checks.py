"""Checks of what rules and network models return. Each complaint names the plug-in."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Sequence
from typing import TypeGuard

from desim.errors import ModelError, class_of
from desim.ports import Drop, Frame, LimitsReach, NetworkModel, Rule, Verdict

Plugin = Rule | NetworkModel


def checked_delay(plugin: Plugin, does: str, delay_ns: object) -> int:
    """``delay_ns``. Raises ``ModelError`` unless it is an int >= 0."""
    if type(delay_ns) is not int or delay_ns < 0:
        raise ModelError(f"{class_of(plugin)} {does} {delay_ns!r}; wanted: an int >= 0 of "
                         "nanoseconds")
    return delay_ns


def arrival_of(model: NetworkModel, delay_ns: object) -> int:
    """The delay that a model's ``send`` returned. Raises ``ModelError`` unless it is one."""
    if type(delay_ns) is int and delay_ns >= 0:
        return delay_ns
    if isinstance(delay_ns, Verdict):
        raise ModelError(f"{class_of(model)} returned {delay_ns!r} from send; wanted: a delay in "
                         "ns, or None and a call of context.settle(frame, receiver, verdict)")
    return checked_delay(model, "delivers after", delay_ns)


def is_complete(given: object, receivers: int) -> TypeGuard[Sequence[Verdict]]:
    """Whether a rule gave one verdict for each of ``receivers``."""
    return isinstance(given, Sequence) and len(given) == receivers


def no_verdicts(rule: Rule, given: object, receivers: int) -> ModelError:
    """The error about what a rule gave instead of one verdict for each of ``receivers``."""
    if isinstance(given, Verdict):  # which are sequences, too
        text = f"the one verdict {given!r}; wanted: None, or a list with one for each receiver"
    elif not isinstance(given, Sequence):
        text = f"{given!r}; wanted: None, or a list of one verdict for each receiver"
    elif len(given) != receivers:
        text = f"{len(given)} verdicts for {receivers} receivers"
    else:
        wrong = (one for one in given if not isinstance(one, Verdict))
        text = f"{next(wrong)!r}, which is no verdict; wanted: PASS, Drop, Deliver or Duplicate"
    return ModelError(f"{class_of(rule)} gave {text}")


def check_packets(plugin: Plugin, packets: Iterable[object], segments: int) -> None:
    """Raises ``ModelError`` unless ``packets`` are numbers of a train of ``segments``."""
    if not all(type(number) is int and 0 <= number < segments for number in packets):
        raise ModelError(f"{class_of(plugin)} dropped the packets {packets!r} of a train of "
                         f"{segments}; wanted: ints from 0 to {segments - 1}")


def undeclared(plugin: Plugin, reason: str) -> ModelError:
    """The error about a reason that the plug-in's class does not declare."""
    if not reason:
        return ModelError(f"{class_of(plugin)} dropped without a reason; write Drop('...') with "
                          f"one of its reasons = {plugin.reasons!r}")
    return ModelError(f"{class_of(plugin)} dropped for {reason!r}, which its class does not "
                      f"declare (reasons = {plugin.reasons!r})")


def reason_of(model: NetworkModel, medium: str, reasons: Collection[str], verdict: object) -> str:
    """The reason of a drop that the model of ``medium`` has settled. Raises ``ModelError`` unless
    it is one of ``reasons``."""
    if type(verdict) is not Drop:
        raise ModelError(f"{_model(model, medium)} settled with {verdict!r}; Deliver or Drop is "
                         "wanted")
    if verdict.reason not in reasons:
        raise undeclared(model, verdict.reason)
    return verdict.reason


def unexpected(model: NetworkModel, medium: str, frame: Frame, receiver: int | Sequence[int] | None
               ) -> ModelError:
    """The error about a fate at a receiver where there is none to settle."""
    (where,) = receiver if isinstance(receiver, tuple) and len(receiver) == 1 else (receiver,)
    return ModelError(f"{_model(model, medium)} settled {frame} at receiver {where}, which is "
                      "settled already or was never intended")


def reach_m_of(part: Plugin) -> float:
    """The distance in m beyond which a rule or a model lets no frame get; infinity if it does not
    say. Raises ``ModelError`` if that is no distance."""
    reach_m = part.reach_m if isinstance(part, LimitsReach) else math.inf
    if not isinstance(reach_m, float | int) or not reach_m >= 0:
        raise ModelError(f"{class_of(part)} has reach_m = {reach_m!r}; wanted: a number of metres "
                         ">= 0")
    return reach_m


def _model(model: NetworkModel, medium: str) -> str:
    return f"{class_of(model)} of medium {medium!r}"
