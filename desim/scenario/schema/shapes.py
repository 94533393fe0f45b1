"""Fields that take one of several shapes: the look of the value decides which one is meant.

Without this, pydantic tries every alternative and complains once for each.
"""

from __future__ import annotations

import types
from collections.abc import Mapping
from difflib import SequenceMatcher
from functools import cache
from typing import Annotated, Union, get_args, get_origin

from pydantic import Discriminator, GetCoreSchemaHandler, Tag
from pydantic_core import CoreSchema

from desim.errors import did_you_mean
from desim.ports import Params

Shapes = tuple[object, ...]  # types: ``str``, ``int``, one ``tuple[X, ...]`` and ``Params`` classes


class ByShape:
    """Marks a union of such types: ``laser: Annotated[str | Laser, BY_SHAPE]``."""

    def __get_pydantic_core_schema__(self, union: object,
                                     handler: GetCoreSchemaHandler) -> CoreSchema:
        shapes = get_args(union)

        def pick(value: object) -> str | None:
            return which(shapes, value)

        tagged = tuple(Annotated[shape, Tag(tag(shape))] for shape in shapes)
        return handler.generate_schema(
            Annotated[Union[tagged], Discriminator(pick)])  # noqa: UP007


BY_SHAPE = ByShape()


def tag(shape: object) -> str:
    """The element that pydantic puts into an error's location for this alternative."""
    # No key of a YAML file can begin with NUL.
    return f"\0{getattr(get_origin(shape) or shape, '__name__', shape)}"


def which(shapes: Shapes, value: object) -> str | None:
    """The tag of the alternative that ``value`` is meant to be, None if it is none of them.

    Among mappings it is the one whose keys ``value`` has, or nearly has, most of; of several blocks
    none if it has no key like one of theirs.
    """
    if isinstance(value, dict):
        blocks = [shape for shape in shapes if isinstance(shape, type) and
                  issubclass(shape, Params)]
        known = next((shape for shape in blocks if value.keys() <= {*keys(shape)}), None)
        alike = [_likeness(value, shape) for shape in blocks]
        if known is None and len(blocks) > 1 and not any(alike):
            return None
        return tag(known or blocks[alike.index(max(alike))]) if blocks else None
    for shape in shapes:
        kind = get_origin(shape) or shape
        if isinstance(kind, type) and isinstance(value, (list, tuple) if kind is tuple else kind):
            return tag(shape)
    return None


@cache
def keys(block: type[Params]) -> tuple[str, ...]:
    """The YAML keys of a parameter block."""
    return tuple(field.alias or name for name, field in block.model_fields.items())


def alternatives(annotation: object) -> dict[str, object]:
    """Tag to alternative of a union of shapes; empty for any other type."""
    if get_origin(annotation) is Annotated:  # as it stands inside of another type
        annotation = get_args(annotation)[0]
    options = without_null(annotation)
    return {tag(option): option for option in options} if len(options) > 1 else {}


def without_null(annotation: object) -> Shapes:
    """The alternatives of a union beside null, or the one type that ``annotation`` is."""
    if get_origin(annotation) in (Union, types.UnionType):
        return tuple(option for option in get_args(annotation) if option is not types.NoneType)
    return (annotation,)


def _likeness(value: Mapping[object, object], block: type[Params]) -> float:
    """2 for each key that ``block`` has, up to 1 for one that it nearly has."""
    known = keys(block)
    return sum(2.0 if key in known else max((_similarity(str(key), name) for name in known),
                                            default=0.0) for key in value)


def _similarity(word: str, name: str) -> float:
    """Of a word to a name that it may be meant for (``did_you_mean``), else 0."""
    return SequenceMatcher(None, name, word).ratio() if did_you_mean(word, [name]) else 0.0
