"""What a preset stands for: defaults that differ between implementations or versions."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

Preset = Mapping[str, Any]  # parameters as a scenario gives them


def filled(given: Any, key: str, default: str, presets: Mapping[str, Preset]) -> Any:
    """``given`` with the values of the preset that it names under ``key``, where it has none of its
    own. What is wrong with it, others say."""
    if not isinstance(given, dict):
        return given
    name = given.get(key, default)
    return {**presets.get(name, {}), **given} if isinstance(name, str) else given
