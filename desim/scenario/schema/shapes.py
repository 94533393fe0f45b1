"""Fields that take one of several shapes: which one is meant is decided by how the value looks.

Without this, pydantic tries every alternative and complains once for each.
"""

from __future__ import annotations

from functools import cache
from typing import Annotated, Any, Union, get_args, get_origin

from pydantic import Discriminator, Tag

from desim.errors import did_you_mean
from desim.ports import Params


def tag(shape: Any) -> str:
    """The element that pydantic puts into an error's location for this alternative."""
    # No key of a YAML file can begin with NUL.
    return f"\0{getattr(get_origin(shape) or shape, '__name__', shape)}"


def by_shape(*shapes: Any) -> Any:
    """A union of ``str``, one ``tuple[X, ...]`` and ``Params`` classes."""
    def pick(value: Any) -> str | None:
        return which(shapes, value)

    tagged = tuple(Annotated[shape, Tag(tag(shape))] for shape in shapes)
    return Annotated[Union[tagged], Discriminator(pick)]  # noqa: UP007


def which(shapes: tuple, value: Any) -> str | None:
    """The tag of the alternative that ``value`` is meant to be, None if it is none of them.

    Among mappings it is the one whose keys ``value`` has, or nearly has, most of.
    """
    if isinstance(value, dict):
        blocks = [shape for shape in shapes if isinstance(shape, type) and
                  issubclass(shape, Params)]
        known = next((shape for shape in blocks if value.keys() <= {*keys(shape)}), None)
        return tag(known or max(blocks, key=lambda shape: _likeness(value, shape))) \
            if blocks else None
    for shape in shapes:
        kind = get_origin(shape) or shape
        if isinstance(value, (list, tuple) if kind is tuple else kind):
            return tag(shape)
    return None


@cache
def keys(block: type[Params]) -> tuple[str, ...]:
    """The YAML keys of a parameter block."""
    return tuple(field.alias or name for name, field in block.model_fields.items())


def alternatives(annotation: Any) -> dict[str, Any]:
    """Tag to alternative of a ``by_shape`` field's annotation; empty for any other."""
    found = {}
    if get_origin(annotation) is Annotated:  # as it stands inside of another one
        annotation = get_args(annotation)[0]
    for option in get_args(annotation):
        tags = [extra.tag for extra in getattr(option, "__metadata__", ()) if
                isinstance(extra, Tag)]
        if tags:
            found[tags[0]] = get_args(option)[0]
    return found


def _likeness(value: dict, block: type[Params]) -> int:
    known = keys(block)
    return sum(2 if key in known else bool(did_you_mean(str(key), known)) for key in value)
