"""Parameter blocks as options of a command: ``--rate 54`` for ``rate_bps: BitRate``."""

from __future__ import annotations

import re
import types
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any, Literal, Union, get_args, get_origin

from pydantic.fields import FieldInfo

from desim.errors import InputError, did_you_mean
from desim.ports import Params
from desim.scenario.complaints import validated

_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?")
_TRUTH = {"true": True, "yes": True, "on": True, "false": False, "no": False, "off": False}


def parsed(words: Sequence[str], block: type[Params], more: Sequence[str] = ()) -> Params:
    """``--key value``, ``--key=value`` and, for what is true or false, ``--key`` alone. A bare
    number has the unit of the option's default, or of its first example. ``more``: options that
    are read elsewhere.

    Raises ``InputError``, a line for each option that is wrong.
    """
    fields = {info.alias or name: info for name, info in block.model_fields.items()}
    given: dict[str, Any] = {}
    rest = list(words)
    while rest:
        key, value = _taken(rest, fields, more)
        if key in given:
            raise InputError(f"--{key}: it is given twice")
        given[key] = value
    result = validated(block, given)
    if isinstance(result, list):
        raise InputError(*(f"--{'.'.join(map(str, complaint.path))}: {complaint.text}"
                           for complaint in result))
    return result


def _taken(rest: list[str], fields: dict[str, FieldInfo],
           more: Sequence[str]) -> tuple[str, Any]:
    """The first option and its value, taken from ``rest``."""
    word = rest.pop(0)
    name, has_value, value = word.removeprefix("--").partition("=")
    key = name.replace("-", "_")
    if not word.startswith("--"):
        raise InputError(f"{word!r} is no option; wanted: --key value")
    if key not in fields:
        known = [f"--{key.replace('_', '-')}" for key in (*fields, *more)]
        raise InputError(f"--{name}: there is no such option{did_you_mean(f'--{name}', known)}; "
                         f"allowed: {', '.join(known)}")
    info = fields[key]
    if not has_value:
        if bool in _types(info) and not (rest and rest[0].lower() in _TRUTH):
            return key, True
        if not rest or rest[0].startswith("--"):
            raise InputError(f"--{name}: its value is missing, e.g. --{name} {_example(info)}")
        value = rest.pop(0)
    return key, _read(value, info)


def _read(text: str, info: FieldInfo) -> Any:
    """What a scenario would have in the place of ``text``."""
    if text == "none" and type(None) in _types(info):
        return None
    if bool in _types(info):
        return _TRUTH.get(text.lower(), text)
    if not _NUMBER.fullmatch(text):
        return text
    unit = _unit(info)
    if unit:
        return f"{text} {unit}"
    return text if str in _types(info) else float(text) if re.search(r"[.eE]", text) else int(text)


def _unit(info: FieldInfo) -> str:
    """Of a bare number; empty if it needs none."""
    example = _example(info)
    return example.partition(" ")[2] if _NUMBER.fullmatch(example.partition(" ")[0]) else ""


def _example(info: FieldInfo) -> str:
    if info.default is None or info.is_required():
        return str(info.examples[0]) if info.examples else "..."
    return str(info.default)


def _types(info: FieldInfo) -> tuple[Any, ...]:
    """The types of its values, text for one of several words."""
    options = (get_args(info.annotation)
               if get_origin(info.annotation) in (Union, types.UnionType) else (info.annotation,))
    return tuple(str if get_origin(option) is Literal else option for option in options)


def told(block: type[Params]) -> Iterator[tuple[str, str]]:
    """Each option with what it takes, and its description with the default and its source."""
    for name, info in block.model_fields.items():
        options = next((get_args(option) for option in (info.annotation, *get_args(info.annotation))
                        if get_origin(option) is Literal), ())
        takes = "|".join(map(str, options)) or _unit(info) or (
            "" if bool in _types(info) else "N")
        default = "" if info.default is None else f"; default {info.default}"
        yield (f"--{(info.alias or name).replace('_', '-')} {takes}".rstrip(),
               f"{info.description or ''}{default}")


@contextmanager
def as_options() -> Iterator[None]:
    """What plug-ins say of a parameter, ``.rate: ...``, is about an option, ``--rate: ...``."""
    try:
        yield
    except InputError as error:
        raise InputError(*(f"--{line[1:]}" if line.startswith(".") else line
                           for line in map(str, error.args))) from error
