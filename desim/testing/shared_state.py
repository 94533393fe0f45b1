"""State that instances of a class share: attributes of the class, and globals of its module."""

from __future__ import annotations

import pickle
from collections.abc import Iterator
from contextlib import contextmanager
from inspect import getmodule
from types import ModuleType

from desim.testing.advice import need


@contextmanager
def own_state(cls: object) -> Iterator[None]:
    """Check that no state changes meanwhile that all instances of ``cls`` share: what one robot
    writes there, another one reads without a network. State that cannot be pickled is not seen."""
    before = _shared(cls)
    yield
    after = _shared(cls)
    changed = [name for name in sorted({*before, *after}) if before.get(name) != after.get(name)]
    need(not changed, cls, f"keep its state in self: {', '.join(changed)} changed, and all robots "
                           "share it")


def _shared(cls: object) -> dict[str, bytes]:
    """The values by name, pickled."""
    owners = [(one.__qualname__, one) for one in getattr(cls, "__mro__", ()) if one is not object]
    module = getmodule(cls)
    if module is not None:
        owners.append((module.__name__, module))
    found = {f"{owner}.{name}": _pickled(value) for owner, where in owners
             for name, value in list(vars(where).items()) if not name.startswith("__")}
    return {name: value for name, value in found.items() if value is not None}


def _pickled(value: object) -> bytes | None:
    """None for code, and for what cannot be pickled."""
    if callable(value) or isinstance(value, ModuleType | property | classmethod | staticmethod):
        return None
    try:
        return pickle.dumps(value)
    except Exception:  # whatever somebody else's class raises
        return None
