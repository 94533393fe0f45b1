"""Complaints to the author of a plug-in."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any, TypeVar

from pydantic import ValidationError

from desim import plugins, ports
from desim.errors import InputError
from desim.scenario.complaints import lines, validated
from desim.scenario.load import from_mapping
from desim.scenario.schema.scenario import Scenario
from desim.scenario.source_places import Places, SourcePlace

P = TypeVar("P")

# The class of a plug-in: made with an instance of its ``Params``.
PluginClass = Callable[[Any], P]


def made(cls: PluginClass[P], params: dict[str, object]) -> P:
    """A plug-in with these parameters. Raises ``InputError`` for wrong ones."""
    return cls(parsed(cls, params))


def parsed(cls: object, params: dict[str, object]) -> ports.Params:
    """The parameters, parsed as those of a scenario are. Raises ``InputError`` for wrong ones."""
    block = plugins.block_of(cls)
    if block is None:
        raise complaint(cls, "have a class Params(desim.ports.Params)")
    found = validated(block, params)
    if isinstance(found, list):
        raise InputError(*lines(found, Places(SourcePlace(_name(cls)))))
    return found


def need(kept: object, cls: object, advice: str) -> None:
    """Raises ``AssertionError`` with ``advice`` for the author of ``cls`` unless it is ``kept``."""
    if not kept:
        raise complaint(cls, advice)


def complaint(cls: object, advice: str) -> AssertionError:
    """The error that gives the author of ``cls`` this advice."""
    return AssertionError(f"{_name(cls)} must {advice}")


def _name(cls: object) -> str:
    return f"{cls.__module__}.{getattr(cls, '__qualname__', cls)}"


def check_form(kind: str, cls: PluginClass[object] | type[ports.Builds],
               params: dict[str, object]) -> None:
    """Check that a plug-in has the methods and declarations of its contract, that it describes its
    options and where their defaults come from, and that ``params`` can be written into a scenario
    with all others and read again."""
    misfit = plugins.misfit(kind, cls)
    need(not misfit, cls, misfit)
    given = parsed(cls, params)
    block = type(given)
    for name, field in block.model_fields.items():
        need(field.description or field.is_required(), cls,
             f"say where the default of parameter {name!r} comes from: Field(default, "
             "description=...)")
    written = given.model_dump_json(by_alias=True)
    try:
        again = block.model_validate_json(written, strict=True).model_dump_json(by_alias=True)
    except ValidationError as error:
        again = "; ".join(f"{'.'.join(map(str, one['loc']))}: {one['msg']}"
                          for one in error.errors())
    need(again == written, cls, f"read its parameters as it writes them; {written} gave {again}")
    if isinstance(given, ports.KnowsUnusedKeys):
        _check_unused(cls, given, given.without_effect(from_mapping({"name": "check"}).scenario))


def _check_unused(cls: object, given: ports.Params, found: Iterable[ports.UnusedKeys]) -> None:
    """Check that keys without effect are keys of the plug-in's block or of scenarios."""
    own = [ports.yaml_key(name) for name in type(given).model_fields]
    for one in found:
        need(isinstance(one, ports.UnusedKeys) and one.why, cls,
             f"give for without_effect ports.UnusedKeys with a reason, not {one!r}")
        for key in one.keys:
            first, _, second = key.partition(".")
            need(first in Scenario.model_fields or not first and second in own, cls,
                 f"name for without_effect a key of its own, {', '.join(f'.{n}' for n in own)}, or "
                 f"of a scenario, not {key!r}")
