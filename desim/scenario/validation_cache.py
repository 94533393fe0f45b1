"""Validates a scenario part by part, and remembers parts.

The scenarios of a campaign share most of them.
"""

from __future__ import annotations

import json
from functools import cache, lru_cache
from typing import Annotated, Any

from pydantic import TypeAdapter, ValidationError
from pydantic.fields import FieldInfo

from desim.scenario.complaints import Complaint, validated
from desim.scenario.schema.scenario import Scenario
from desim.scenario.source_places import Data

_REMEMBERED = 256  # parts: those that the vectors of a campaign share come again soon


def _adapter(info: FieldInfo) -> TypeAdapter[Any]:
    kind: Any = info.annotation
    return TypeAdapter(Annotated[(kind, *info.metadata)] if info.metadata else kind)


_PARTS = {name: _adapter(info) for name, info in Scenario.model_fields.items()}


def scenario(data: Data) -> Scenario | list[Complaint]:
    """The same as ``validated(Scenario, data)``, quicker for the second of two that are alike."""
    if data.keys() <= _PARTS.keys() and "name" in data:
        try:
            return Scenario.model_construct(set(data), **_defaults() | {
                name: _part(name, json.dumps(value)) for name, value in data.items()})
        except ValidationError:  # validated says all that is wrong, in the user's words
            pass
    return validated(Scenario, data)


@cache
def _defaults() -> dict[str, Any]:
    return {name: info.get_default(call_default_factory=True)
            for name, info in Scenario.model_fields.items() if not info.is_required()}


@lru_cache(_REMEMBERED)
def _part(name: str, text: str) -> Any:
    return _PARTS[name].validate_json(text, strict=True)
