"""Complaints to the author of a plug-in."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

from pydantic import ValidationError

from desim import ports

P = TypeVar("P")

# The class of a plug-in: made with an instance of its ``Params``.
PluginClass = Callable[[Any], P]


def parameter_block(cls: object) -> type[ports.Params]:
    """The class ``Params`` of a plug-in's class. Raises ``AssertionError`` without one."""
    block = getattr(cls, "Params", None)
    if not (isinstance(block, type) and issubclass(block, ports.Params)):
        raise _complaint(cls, "have a class Params(desim.ports.Params)")
    return block


def made(cls: PluginClass[P], params: dict[str, object]) -> P:
    """A plug-in with these parameters."""
    return cls(parameter_block(cls).model_validate(params))


def need(kept: object, cls: object, advice: str) -> None:
    """Raises ``AssertionError`` with ``advice`` for the author of ``cls`` unless it is ``kept``."""
    if not kept:
        raise _complaint(cls, advice)


def _complaint(cls: object, advice: str) -> AssertionError:
    return AssertionError(f"{cls.__module__}.{getattr(cls, '__qualname__', cls)} must {advice}")


def check_parameters(cls: PluginClass[object], params: dict[str, object]) -> None:
    """Check that a plug-in describes its options and where their defaults come from, and that
    ``params`` can be written into a scenario with all others and read again."""
    block = parameter_block(cls)
    for name, field in block.model_fields.items():
        need(field.description or field.is_required(), cls,
             f"say where the default of parameter {name!r} comes from: Field(default, "
             "description=...)")
    written = block.model_validate(params).model_dump_json(by_alias=True)
    try:
        again = block.model_validate_json(written, strict=True).model_dump_json(by_alias=True)
    except ValidationError as error:
        again = "; ".join(f"{'.'.join(map(str, one['loc']))}: {one['msg']}"
                          for one in error.errors())
    need(again == written, cls, f"read its parameters as it writes them; {written} gave {again}")
