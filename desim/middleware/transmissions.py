"""What rules say of single transmissions."""

from __future__ import annotations

from collections.abc import Sequence

from desim.errors import ModelError
from desim.middleware.gate import class_of, undeclared
from desim.ports import PASS, Drop, Frame, Pass, Rule


class Transmissions:
    """Asks rules about single transmissions, for a model whose MAC repeats what is lost."""

    def __init__(self, rules: Sequence[Rule]) -> None:
        self._rules = rules
        self.reasons = {reason for rule in rules for reason in rule.reasons}

    def judge(self, frame: Frame, receiver: int) -> Drop | None:
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
