"""What rules say of single transmissions."""

from __future__ import annotations

from collections.abc import Sequence

from desim.errors import ModelError, class_of
from desim.network.answers import undeclared
from desim.ports import PASS, Drop, Frame, NetworkModel, Pass, Rule


class Transmissions:
    """Asks those of a medium's rules that are ``per_transmission``, for a model whose MAC repeats
    what is lost; ``others`` judge frames."""

    def __init__(self, model: NetworkModel, rules: Sequence[Rule]) -> None:
        judges = getattr(model, "judges_transmissions", False)
        self._rules = [rule for rule in rules
                       if judges and getattr(rule, "per_transmission", False)]
        self.others = [rule for rule in rules if rule not in self._rules]
        self.reasons = {reason for rule in self._rules for reason in rule.reasons}
        self.ask = self._ask if self._rules else None

    def _ask(self, frame: Frame, receiver: int) -> Drop | None:
        """``ports.Context.judge_transmission``. Raises ``ModelError`` for other verdicts."""
        for rule in self._rules:
            (verdict,) = rule.judge(frame, (receiver,)) or (PASS,)
            if type(verdict) is Drop:
                if verdict.reason not in rule.reasons:
                    raise undeclared(rule, verdict.reason)
                return Drop(verdict.reason)
            if type(verdict) is not Pass:
                raise ModelError(f"{class_of(rule)} gave {verdict!r} of a transmission; wanted: "
                                 "Drop or Pass")
        return None
