"""Parameter blocks of plug-ins."""

from __future__ import annotations

import re
from collections.abc import Mapping
from functools import lru_cache
from typing import Annotated, ClassVar, NamedTuple, Self, TypeAlias

from pydantic import BaseModel, ConfigDict, model_validator

from desim.units import DURATION

Preset: TypeAlias = Mapping[str, object]  # parameters as a scenario gives them


class Named(NamedTuple):
    """Values of parameters under a name: what they stand for, with its source."""

    about: str
    values: Preset


_UNIT = re.compile(r"_(ns|ps|bps|bytes|m|mps|mps2|rad|radps|radps2|hz|db|dbm|ppb|w|j|jpm)$")


def yaml_key(field: str) -> str:
    """``rate_bps`` to ``rate``: the unit stands in the value in YAML, in the name in Python."""
    return _UNIT.sub("", field)


class Params(BaseModel):
    """Base of every parameter block: frozen, unknown keys are errors, defaults are checked.

    A field's Python name carries its unit (``rate_bps``); its YAML key, and the keyword to
    construct it with, does not (``rate``). Its description ends with the default's source in
    parentheses. ``meanings``: by key of a choice between names, what each of them stands for, which
    ``desim describe`` prints.
    """

    meanings: ClassVar[Mapping[str, Mapping[str, Named]]] = {}
    model_config = ConfigDict(extra="forbid", frozen=True, validate_default=True,
                              alias_generator=yaml_key, protected_namespaces=())


class Constants(Params):
    """Base of the times and sizes that a real implementation fixes, each with its source.

    They are no keys of their own: the parameter ``constants`` of a block changes single ones.
    ``ascending`` has pairs of fields of durations, of which the first must not be above the second.
    """

    ascending: ClassVar[tuple[tuple[str, str], ...]] = ()

    @model_validator(mode="after")
    def _ascend(self) -> Self:
        for low, high in self.ascending:
            low_ns, high_ns = getattr(self, low), getattr(self, high)
            if low_ns > high_ns:
                raise ValueError(f"{yaml_key(low)} must not be above {yaml_key(high)}, got "
                                 f"{DURATION.format(low_ns)} and {DURATION.format(high_ns)}")
        return self

    @classmethod
    def __get_pydantic_json_schema__(cls, *_: object) -> dict[str, object]:
        return {"type": "object", "default": {},
                "description": f"single values of {cls.__module__}:{cls.__name__}"}


def tuples(given: object) -> object:
    """``given`` with tuples in place of its lists: pydantic, which is strict, takes no list for a
    tuple in what a validator of the whole block returns."""
    if isinstance(given, dict):
        return {key: tuples(value) for key, value in given.items()}
    return tuple(map(tuples, given)) if isinstance(given, list) else given


def with_preset(given: object, key: str, default: str, presets: Mapping[str, Preset]) -> object:
    """The parameters ``given``, with those of the preset that they name under ``key`` where they
    have none; inside of a block key by key, unless it names another model. Unknown names are left
    for the validator to report."""
    named = given.get(key, default) if isinstance(given, dict) else default
    return _completed(given, presets.get(str(named), {}))


def _completed(value: object, preset: object) -> object:
    if not (isinstance(value, dict) and isinstance(preset, Mapping)
            and value.get("model", preset.get("model")) == preset.get("model")):
        return value
    return {**preset, **{key: _completed(own, preset.get(key)) for key, own in value.items()}}


class BesideScenario:
    """Marks a parameter as the path of a file: relative, in a scenario, to the file that names it;
    absolute for the plug-in. The file's content belongs to a run's identity."""


File = Annotated[str, BesideScenario()]  # the type of a parameter


@lru_cache(maxsize=1 << 12)
def natural_key(name: str) -> tuple[tuple[tuple[int, int, str], ...], str]:
    """Sorts ``robot_2`` before ``robot_10``: the order of host and robot indices."""
    return tuple((0, int(part), "") if part.isdecimal() else (1, 0, part)
                 for part in re.split(r"(\d+)", name) if part), name
