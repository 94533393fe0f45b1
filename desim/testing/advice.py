"""Complaints to the author of a plug-in."""

from __future__ import annotations

from typing import Any, Protocol, TypeVar

from pydantic import ValidationError

from desim import ports

P_co = TypeVar("P_co", covariant=True)


class PluginClass(Protocol[P_co]):
    """The class of a plug-in."""

    @property
    def Params(self) -> type[ports.Params]:  # noqa: N802 - plug-ins have a class of this name
        """Its parameter block."""

    def __call__(self, params: Any) -> P_co:
        """A plug-in with these parameters, an instance of ``Params``."""


def made(cls: PluginClass[P_co], params: dict[str, object]) -> P_co:
    """A plug-in with parameters as a scenario gives them."""
    return cls(cls.Params.model_validate(params))


def need(kept: object, cls: object, advice: str) -> None:
    """Raises ``AssertionError`` with ``advice`` for the author of ``cls`` unless it is ``kept``."""
    if not kept:
        name = f"{cls.__module__}.{getattr(cls, '__qualname__', cls)}"
        raise AssertionError(f"{name} must {advice}")


def check_parameters(cls: PluginClass[object], params: dict[str, object]) -> None:
    """Check that a plug-in describes its options and where their defaults come from, and that
    ``params`` can be written into a scenario with all others and read again."""
    block = getattr(cls, "Params", None)
    need(isinstance(block, type) and issubclass(block, ports.Params), cls,
         "have a class Params(desim.ports.Params)")
    for name, field in cls.Params.model_fields.items():
        need(field.description or field.is_required(), cls,
             f"say where the default of parameter {name!r} comes from: Field(default, "
             "description=...)")
    written = cls.Params.model_validate(params).model_dump_json(by_alias=True)
    try:
        again = cls.Params.model_validate_json(written, strict=True).model_dump_json(by_alias=True)
    except ValidationError as error:
        again = "; ".join(f"{'.'.join(map(str, one['loc']))}: {one['msg']}"
                          for one in error.errors())
    need(again == written, cls, f"read its parameters as it writes them; {written} gave {again}")
