"""YAML of strangers: refused before it is built, if that would take long or much memory."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import yaml

try:  # libyaml reads ten times as fast
    from yaml import CSafeLoader as SafeLoader
except ImportError:
    from yaml import SafeLoader

_DEEPEST = 100
_TOO_DEEP = f"nested too deeply; at most {_DEEPEST} lists and mappings"
_LONGEST = 10_000  # characters of what may be a number, which can take long to read
_MOST_VALUES = 100_000  # keys count as values, and an alias for all that it stands for


def check(text: str | bytes) -> None:
    """Raise ``ValueError`` for values that are too many, too long or too deeply nested, and
    ``yaml.YAMLError`` for what is no YAML."""
    sizes: dict[str, int] = {}  # by anchor
    above: list[tuple[str | None, int]] = []  # the open lists and mappings: anchor, values before
    values = 0
    for event in _events(text):
        if isinstance(event, yaml.AliasEvent):
            values += sizes.get(event.anchor, 0)
        elif isinstance(event, yaml.ScalarEvent):
            values += 1
            if len(event.value) > _LONGEST and (event.implicit[0] or event.tag):
                raise ValueError(f"a value of {len(event.value)} characters without quotes; at "
                                 f"most {_LONGEST}")
            if event.anchor:
                sizes[event.anchor] = 1
        elif isinstance(event, yaml.CollectionStartEvent):
            above.append((event.anchor, values))
            values += 1
        elif isinstance(event, yaml.CollectionEndEvent):
            anchor, before = above.pop()
            if anchor:
                sizes[anchor] = values - before
        if len(above) > _DEEPEST:
            raise ValueError(_TOO_DEEP)
        if values > _MOST_VALUES:
            raise ValueError(f"more than {_MOST_VALUES} keys and values, aliases written out")


def _events(text: str | bytes) -> Iterator[yaml.Event]:
    try:
        yield from yaml.parse(text, Loader=SafeLoader)
    except yaml.MarkedYAMLError as error:
        if error.problem == "exceeded maximum nesting depth":  # libyaml's own, a thousand
            raise ValueError(_TOO_DEEP) from None
        raise


def read(text: str | bytes) -> Any:
    """The value of a document. Raises as ``check`` does."""
    check(text)
    return yaml.load(text, Loader=SafeLoader)
