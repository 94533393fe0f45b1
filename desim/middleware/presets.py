"""Presets: named sets of default parameters, one per implementation or version."""

from __future__ import annotations

from collections.abc import Mapping

Preset = Mapping[str, object]  # parameters as a scenario gives them


def filled(given: object, key: str, default: str, presets: Mapping[str, Preset]) -> object:
    """Fill in ``given`` from the preset that it names under ``key``; its own values win. Unknown
    names are left for the validator to report."""
    if not isinstance(given, dict):
        return given
    name = given.get(key, default)
    return {**presets.get(name, {}), **given} if isinstance(name, str) else given
