"""Conditions that cause a sample at the instant in which one of them becomes true."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence

from desim.scenario.expression import Condition, of_quantities


class Triggers:
    """The conditions ``texts`` over ``names``. Raises ``InputError`` for what is none."""

    def __init__(self, texts: Sequence[str], names: Collection[str]) -> None:
        self._conditions: list[Condition] = [of_quantities(text, names) for text in texts]
        self._held = [False] * len(texts)

    def __len__(self) -> int:
        return len(self._conditions)

    def newly_met(self, values: Mapping[str, float]) -> list[str]:
        """The conditions that hold now, and did not when they were looked at last."""
        before, self._held = self._held, [condition.evaluate(values) is True
                                          for condition in self._conditions]
        return [condition.text for condition, held, did
                in zip(self._conditions, self._held, before, strict=True) if held and not did]
