"""The rules in front of a medium, and what each of them sees of it."""

from __future__ import annotations

from collections.abc import Sequence
from operator import attrgetter
from typing import TYPE_CHECKING, TypeVar

import numpy as np

from desim.errors import ModelError, class_of
from desim.network.answer_checks import (
    check_packets,
    checked_delay,
    is_complete,
    no_verdicts,
    undeclared,
)
from desim.network.carrier import Carrier
from desim.network.scoped_rule import Scoped, ScopedQueue
from desim.network.terms import PLAIN, Terms
from desim.ports import (
    Deliver,
    Drop,
    Duplicate,
    Frame,
    Frames,
    JudgesTransmissions,
    NetworkModel,
    Pass,
    PassesMany,
    Retransmits,
    Rule,
    Verdict,
)

if TYPE_CHECKING:
    from desim.network.medium import Medium

T = TypeVar("T")


class Gate:
    """Asks the rules of ``medium`` about frames and carries out their verdicts.

    If ``model`` retransmits, it asks the rules with ``per_transmission`` itself, through
    ``judge_transmission`` (None: no such rule), and may drop for their ``reasons``. ``open``: no
    other rules exist, so frames need not be admitted.
    """

    def __init__(self, rules: Sequence[Rule], model: NetworkModel, medium: Medium) -> None:
        self._medium = medium
        repeats = isinstance(model, Retransmits) and model.judges_transmissions
        self._repeated = [rule for rule in rules if repeats and isinstance(
            rule, JudgesTransmissions) and rule.per_transmission]
        self._judges = [(rule, rule.judge) for rule in rules if rule not in self._repeated]
        self._queues = [rule for rule in rules if isinstance(rule, ScopedQueue)]
        self._by_topics = [rule for rule in rules if isinstance(rule, Scoped) and rule.topics]
        self.judge_transmission = self._judge_transmission if self._repeated else None
        self.reasons = {reason for rule in self._repeated for reason in rule.reasons}
        self.open = not self._judges
        self._all_pass = [rule.all_pass if isinstance(rule, PassesMany) else None
                          for rule, _ in self._judges]

    def all_pass(self, frames: Frames) -> bool:
        """Whether all rules let each of ``frames`` pass unchanged, as far as they can tell of many
        at once."""
        return all(all_pass is not None and all_pass(frames) for all_pass in self._all_pass)

    def admit(self, frame: Frame, carrier: Carrier[T], token: T
              ) -> tuple[Frame, dict[int, Terms] | None, int]:
        """Ask the rules about ``frame``. Returns it for the receivers that remain, the terms of
        each, and the time (ns) that it waits in queues of rules. Terms are None if no rule had
        anything to say, and empty if no receiver remains. Raises ``ModelError`` for a wrong
        verdict."""
        if self._queues:
            self._medium.held.release()
        for scoped in self._by_topics:
            scoped.follow(carrier.topics(token))
        terms = None
        for rule, judge in self._judges:
            verdicts = judge(frame, frame.receivers)
            if verdicts is None:
                continue
            terms = self._obey(rule, verdicts, frame, terms, carrier, token)
            if not terms:
                self._medium.barred_bytes[frame.source] += frame.size_bytes
                break
            if len(terms) < len(frame.receivers):
                frame = frame._replace(receivers=tuple(terms))
        wait_ns = sum(queue.wait_ns for queue in self._queues) if self._queues else 0
        return frame, terms, wait_ns

    def _obey(self, rule: Rule, verdicts: Sequence[Verdict], frame: Frame,
              terms: dict[int, Terms] | None, carrier: Carrier[T], token: T) -> dict[int, Terms]:
        """``terms`` as ``rule`` changes them, without the receivers at which it drops the frame."""
        receivers = frame.receivers
        if terms is None:
            terms = dict.fromkeys(receivers, PLAIN)
        if not is_complete(verdicts, len(receivers)):
            raise no_verdicts(rule, verdicts, len(receivers))
        for receiver, verdict in zip(receivers, verdicts, strict=True):
            if type(verdict) is Deliver:
                own = terms[receiver]
                terms[receiver] = own._replace(
                    delay_ns=own.delay_ns + checked_delay(rule, "delays by", verdict.delay_ns))
            elif type(verdict) is Drop:
                if self._drops(rule, verdict, frame, receiver, terms):
                    carrier.lost(token, receiver, verdict.reason)
            elif type(verdict) is Duplicate:
                own = terms[receiver]
                after_ns = checked_delay(rule, "makes a copy after", verdict.after_ns)
                terms[receiver] = own._replace(copies_ns=(*own.copies_ns, after_ns))
            elif type(verdict) is not Pass:
                raise no_verdicts(rule, verdicts, len(receivers))
        return terms

    def _drops(self, rule: Rule, verdict: Drop, frame: Frame, receiver: int,
               terms: dict[int, Terms]) -> bool:
        """Take what the rule drops at one receiver out of its terms. Returns whether that was all
        that there was left of the frame."""
        if verdict.reason not in rule.reasons:
            raise undeclared(rule, verdict.reason)
        before = terms[receiver]
        lost = frame.segments - len(before.lost)
        if verdict.packets is not None:
            check_packets(rule, verdict.packets, frame.segments)
            terms[receiver] = after = before.losing(verdict.packets, verdict.reason)
            if len(after.lost) < frame.segments:
                self._medium.count_drops(verdict.reason, 0, len(after.lost) - len(before.lost))
                return False
        del terms[receiver]
        self._medium.count_drops(verdict.reason, 1, lost)
        return True

    def _judge_transmission(self, frame: Frame, receiver: int) -> Drop | None:
        """See ``ports.Context``. Raises ``ModelError`` for other verdicts."""
        for scoped in self._by_topics:
            scoped.follow(self._topics(frame))
        for rule in self._repeated:
            verdicts = rule.judge(frame, (receiver,))
            if verdicts is None:
                continue
            verdict = verdicts[0] if is_complete(verdicts, 1) else None
            if type(verdict) is Drop:
                if verdict.reason not in rule.reasons:
                    raise undeclared(rule, verdict.reason)
                return Drop(verdict.reason)
            if type(verdict) is Deliver or type(verdict) is Duplicate:
                raise ModelError(f"{class_of(rule)} gave {verdict!r} of a transmission; wanted: "
                                 "Drop or Pass")
            if type(verdict) is not Pass:
                raise no_verdicts(rule, verdicts, 1)
        return None

    def _topics(self, frame: Frame) -> tuple[str, ...]:
        """The topics of an open frame; none of a frame of the model's own."""
        found = self._medium.carried(frame)
        return () if found is None else found[0].topics(found[1])


class MediumView:
    """The ``ports.RuleContext`` of the rule called ``name``."""

    def __init__(self, medium: Medium, name: str) -> None:
        self._medium = medium
        self._name = name
        self._kernel = medium._kernel
        self.positions = medium.positions

    now_ns = property(attrgetter("_kernel.now_ns"))
    antennas = property(attrgetter("_medium.antennas"))
    obstacles = property(attrgetter("_medium.obstacles"))

    def stream(self, *name: str | int) -> np.random.Generator:
        return self._medium.stream(self._name, *name)
