"""Keys of a scenario without effect, which the parameters of a plug-in know of."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any, NamedTuple, Protocol, runtime_checkable

from desim.ports.parameters import Params, yaml_key


class UnusedKeys(NamedTuple):
    """Keys of a scenario, and why they have no effect. Those of the plug-in's own block begin with
    a dot, ``.rate``; others are whole, ``stop.by``."""

    keys: Sequence[str]
    why: str


@runtime_checkable
class ReadsMarks(Protocol):
    """Parameters of a network model for which the marks of packets (DSCP) may count."""

    @property
    def reads_marks(self) -> bool:
        """Whether they do."""


@runtime_checkable
class KnowsUnusedKeys(Protocol):
    """Parameters that know which keys have no effect, because of the values of others."""

    def without_effect(self, scenario: Any) -> Iterable[UnusedKeys]:
        """The keys, by reason, of a complete ``desim.scenario.schema.scenario.Scenario``. A run
        warns of them, if there are any."""


def changed_keys(block: Params, *fields: str) -> list[str]:
    """The keys ``.rate`` of those of ``fields`` whose value is not the default. (A run's scenario
    has all keys, so which of them somebody wrote is not known.)"""
    cls = type(block)
    required = {name for name, info in cls.model_fields.items() if info.is_required()}
    usual = cls.model_validate_json(block.model_dump_json(by_alias=True, include=required))
    return [f".{yaml_key(name)}" for name in fields
            if getattr(block, name) != getattr(usual, name)]
