"""A scenario validated part by part: of the many of a campaign most parts are the same."""

from __future__ import annotations

import json
from functools import cache, lru_cache
from typing import Annotated, Any

from pydantic import TypeAdapter, ValidationError

from desim.scenario.complaints import Complaint, validated
from desim.scenario.schema.whole import Scenario

_REMEMBERED = 256  # parts: those that the vectors of a campaign share come again soon
_KINDS = {name: TypeAdapter(Annotated[(info.annotation, *info.metadata)] if info.metadata
                            else info.annotation)
          for name, info in Scenario.model_fields.items()}


def scenario(data: dict[str, Any]) -> Scenario | list[Complaint]:
    """``validated(Scenario, data)``."""
    if data.keys() <= _KINDS.keys() and "name" in data:
        try:
            return Scenario.model_construct(set(data), **_defaults() | {
                name: _part(name, json.dumps(value)) for name, value in data.items()})
        except ValidationError:  # what is wrong, in the words for users, and all of it:
            pass
    return validated(Scenario, data)


@cache
def _defaults() -> dict[str, Any]:
    return {name: info.get_default(call_default_factory=True)
            for name, info in Scenario.model_fields.items() if not info.is_required()}


@lru_cache(_REMEMBERED)
def _part(name: str, text: str) -> Any:
    return _KINDS[name].validate_json(text, strict=True)
