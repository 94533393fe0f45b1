"""What a preset stands for: defaults that differ between implementations or versions."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

Preset = Mapping[str, Any]  # parameters as a scenario gives them


def filled(given: Any, key: str, default: str, presets: Mapping[str, Preset]) -> Any:
    """Fill in ``given`` from the preset that it names under ``key``; its own values win. Unknown
    names are left for the validator to report."""
    if not isinstance(given, dict):
        return given
    name = given.get(key, default)
    return {**presets.get(name, {}), **given} if isinstance(name, str) else given
