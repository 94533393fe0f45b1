"""The reference of a scenario's keys, from the schema: type, unit, default, and what it means."""

from __future__ import annotations

import inspect
from collections.abc import Iterator
from types import NoneType, UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin

from pydantic import BeforeValidator
from pydantic.fields import FieldInfo

from desim.ports import Constants, Params
from desim.scenario.schema.scenario import Scenario
from desim.units import RATIO, Dimension
from site_pages.text import code, inline, prose, table

_WORDS = {str: "text", int: "whole number", float: "number", bool: "true or false",
          object: "anything", Any: "anything"}
_HEAD = ("key", "value", "default", "what it is")


def page() -> str:
    """All keys, a section for each family."""
    parts = ["# Keys of a scenario", (
        "Made from the schema that checks scenarios, so that it is complete. "
        "Where a plug-in is chosen (a network model, a rule, a middleware, a strategy), its own "
        "parameters stand beside the keys here: [plug-ins](plugins/index.md). `extends: FILE` "
        "lays a scenario over another one. "
        "[Scenarios](../docs/scenarios.md) explains what needs more words."),
        "## Top level", table(_HEAD, [row for row, _ in _rows("", Scenario)])]
    for name, block in _blocks("", Scenario):
        parts += [f"## {name}", *_section(name, block)]
    return "\n\n".join(parts) + "\n"


def parameter_table(block: type[Params]) -> str:
    """The parameters of a plug-in, those of its blocks below them, and its constants."""
    return "\n\n".join([table(_HEAD, list(_all_rows("", block))), *_constants("", block)])


def _constants(path: str, block: type[Params]) -> Iterator[str]:
    """A table of each set of constants that a block's parameters may change."""
    for name, info in block.model_fields.items():
        kind = info.annotation
        if inspect.isclass(kind) and issubclass(kind, Constants):
            yield prose(f"``{path}{name}``: {inspect.getdoc(kind)}")
            yield table(("constant", *_HEAD[1:]), [row for row, _ in _rows("", kind)])
        for below, inner in blocks_in(f"{path}{info.alias or name}", kind):
            yield from _constants(f"{below}.", inner)


def _all_rows(path: str, block: type[Params]) -> Iterator[tuple[str, str, str, str]]:
    for row, below in _rows(path, block):
        yield row
        for name, inner in below:
            yield from _all_rows(f"{name}.", inner)


def _section(path: str, block: type[Params]) -> Iterator[str]:
    yield prose(inspect.getdoc(block) or "")
    yield table(_HEAD, [row for row, _ in _rows(f"{path}.", block)])
    for name, below in _blocks(f"{path}.", block):
        yield f"### {name}"
        yield prose(inspect.getdoc(below) or "")
        yield table(_HEAD, list(_all_rows(f"{name}.", below)))
        yield from _constants(f"{name}.", below)


def _blocks(path: str, block: type[Params]) -> Iterator[tuple[str, type[Params]]]:
    for _, below in _rows(path, block):
        yield from below


def _rows(path: str, block: type[Params],
          ) -> Iterator[tuple[tuple[str, str, str, str], list[tuple[str, type[Params]]]]]:
    """A row for each key, and the blocks that may stand at it, each with its path."""
    for name, info in block.model_fields.items():
        key = f"{path}{info.alias or name}"
        annotation = Annotated[info.annotation, *info.metadata] if info.metadata else \
            info.annotation
        blocks = list(blocks_in(key, info.annotation))
        about = inline(info.description or "")
        if not about and len(blocks) == 1:
            about = inline(" ".join((inspect.getdoc(blocks[0][1]) or "").split()).split(". ")[0])
        yield (code(key), _value(annotation), _default(info), about), blocks


def blocks_in(key: str, annotation: object) -> Iterator[tuple[str, type[Params]]]:
    """The blocks that may stand at ``key``, each with its path."""
    kind, arguments = get_origin(annotation), get_args(annotation)
    if inspect.isclass(annotation) and issubclass(annotation, Params):
        if not issubclass(annotation, Constants):  # those have a table of their own
            yield key, annotation
    elif kind in (Union, UnionType):
        options = [one for one in arguments if one is not NoneType]
        for option in options:
            yield from blocks_in(key, option)
    elif kind is Annotated:
        yield from blocks_in(key, arguments[0])
    elif kind is tuple and arguments and arguments[-1] is Ellipsis:
        yield from blocks_in(f"{key}.N", arguments[0])
    elif kind is dict:
        yield from blocks_in(f"{key}.NAME", arguments[1])


def _value(annotation: object) -> str:
    """The kind of value: a quantity with its units, words, a number, a list, a mapping."""
    kind, arguments = get_origin(annotation), get_args(annotation)
    if kind is Annotated:
        dimension = _dimension(arguments[1:])
        return dimension or _value(arguments[0])
    if kind in (Union, UnionType):
        return " or ".join(dict.fromkeys("null" if one is NoneType else _value(one)
                                         for one in arguments))
    if kind is Literal:
        return ", ".join(map(code, arguments))
    if kind is tuple:
        return f"list of {_value(arguments[0])}" if arguments[-1] is Ellipsis else \
            f"list of {len(arguments)}: {_value(arguments[0])}"
    if kind is dict:
        return f"mapping of names to {_value(arguments[1])}"
    if inspect.isclass(annotation) and issubclass(annotation, Params):
        return "constants by name" if issubclass(annotation, Constants) else "mapping"
    return _WORDS.get(annotation, getattr(annotation, "__name__", str(annotation)))


def _dimension(metadata: tuple[object, ...]) -> str:
    """The name and units of a quantity; nothing where it is none."""
    for one in metadata:
        parse = getattr(one, "func", None) if isinstance(one, BeforeValidator) else None
        owner = getattr(parse, "__self__", None)
        if isinstance(owner, Dimension):
            units = ", ".join(unit for unit in owner.units if unit not in owner.aliases)
            return f"{owner.name} ({units})"
        if getattr(parse, "__module__", "") == "desim.units":
            return f"{RATIO.name} (%, or 0 to 1)"
    return ""


def _default(info: FieldInfo) -> str:
    if info.is_required():
        return "must be given"
    value = info.get_default(call_default_factory=True)
    if isinstance(value, Params):
        return ""
    if isinstance(value, tuple):
        value = list(value)
    return code("null" if value is None else str(value).lower() if isinstance(value, bool)
                else value)
