"""Parameter blocks as options of a command: ``--rate 54`` for ``rate_bps: BitRate``."""

from __future__ import annotations

import re
import types
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Literal, TypeVar, Union, get_args, get_origin

from pydantic.fields import FieldInfo

from desim.errors import InputError, did_you_mean
from desim.ports import Params
from desim.scenario.complaints import validated

_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?")
P = TypeVar("P", bound=Params)
_TRUTH = {"true": True, "yes": True, "on": True, "false": False, "no": False, "off": False}


def parsed(words: Sequence[str], block: type[P], more: Sequence[str] = ()) -> P:
    """The parameters of ``--key value``, ``--key=value`` and, for a truth value, ``--key`` alone. A
    value without a key belongs to the first option without a default. A bare number has the unit of
    the option's default, or of its first example. Options of many values (``tuple[str, ...]``) can
    be given again. ``more``: options that are read elsewhere.

    Raises ``InputError``, a line for each option that is wrong.
    """
    fields = _fields(block)
    given: dict[str, object] = {}
    rest = list(words)
    while rest:
        key, value = _taken(rest, fields, given, more)
        if _repeats(fields[key]):
            earlier = given.get(key)
            value = (*(earlier if isinstance(earlier, tuple) else ()), value)
        elif key in given:
            raise InputError(f"{_option(key)}: it is given twice")
        given[key] = value
    return checked(given, block)


def checked(given: Mapping[str, object], block: type[P]) -> P:
    """The parameters of values by key, as a scenario has them: a quantity with its unit. Raises
    ``InputError`` as ``parsed`` does."""
    fields = _fields(block)
    for key, info in fields.items():
        if info.is_required() and key not in given:
            raise InputError(f"{key.upper()} is missing: {info.description}")
    result = validated(block, dict(given))
    if isinstance(result, list):
        raise InputError(*(f"{_option('.'.join(map(str, complaint.path)))}: {complaint.text}"
                           f"{_or_none(complaint.text, fields.get(str(complaint.path[0])))}"
                           for complaint in result))
    return result


def _or_none(text: str, info: FieldInfo | None) -> str:
    """The addition to a complaint about an option that may be empty."""
    optional = info is not None and type(None) in _types(info)
    return ", or none" if optional and "; allowed: " in text else ""


def _fields(block: type[Params]) -> dict[str, FieldInfo]:
    return {info.alias or name: info for name, info in block.model_fields.items()}


def _option(key: str) -> str:
    return f"--{key.replace('_', '-')}"


def _taken(rest: list[str], fields: dict[str, FieldInfo], given: dict[str, object],
           more: Sequence[str]) -> tuple[str, object]:
    """The first key and its value, removed from ``rest``."""
    word = rest.pop(0)
    if not word.startswith("--"):
        return _meant(word, fields, given), word
    name, has_value, value = word[2:].partition("=")
    key = name.replace("-", "_")
    if key not in fields:
        known = [*fields, *more]
        raise InputError(f"--{name}: there is no such option{did_you_mean(key, known)}; allowed: "
                         f"{', '.join(map(_option, known))}")
    info = fields[key]
    if has_value:
        return key, _read(value, info)
    if bool in _types(info) and not (rest and rest[0].lower() in _TRUTH):
        return key, True
    if not rest or rest[0].startswith("--"):
        raise InputError(f"--{name}: its value is missing, e.g. --{name} {_example(info)}")
    return key, _read(rest.pop(0), info)


def _meant(word: str, fields: dict[str, FieldInfo], given: dict[str, object]) -> str:
    """The key of a value without one: the first key without a default."""
    for key, info in fields.items():
        if info.is_required() and key not in given:
            return key
    raise InputError(f"{word!r} is no option; wanted: --key value")


def _read(text: str, info: FieldInfo) -> object:
    """The value of ``text`` as a scenario has it."""
    if _repeats(info):
        return text
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


def _repeats(info: FieldInfo) -> bool:
    return get_origin(info.annotation) is tuple


def _unit(info: FieldInfo) -> str:
    """The unit of a bare number; empty if it needs none."""
    example = _example(info)
    return example.partition(" ")[2] if _NUMBER.fullmatch(example.partition(" ")[0]) else ""


def _example(info: FieldInfo) -> str:
    without = info.default in (None, ()) or info.is_required()
    return str((info.examples or ["VALUE"])[0] if without else info.default)


def _types(info: FieldInfo) -> tuple[object, ...]:
    """The types of a field's values, text for one of several words."""
    options = (get_args(info.annotation)
               if get_origin(info.annotation) in (Union, types.UnionType) else (info.annotation,))
    return tuple(str if get_origin(option) is Literal else option for option in options)


def descriptions(block: type[Params]) -> Iterator[tuple[str, str]]:
    """Each option with its kind of value, and its description with the default."""
    for key, info in _fields(block).items():
        if info.is_required():
            yield key.upper(), info.description or ""
            continue
        default = "" if info.default in (None, ()) else f"; default {info.default}"
        yield f"{_option(key)} {_takes(info)}".rstrip(), f"{info.description or ''}{default}"


def _takes(info: FieldInfo) -> str:
    """The kind of value that an option takes: the allowed words, the unit of a bare number, or N.
    """
    if _repeats(info):
        return _example(info)
    for option in (info.annotation, *get_args(info.annotation)):
        if get_origin(option) is Literal:
            return "|".join(map(str, get_args(option)))
    return "" if bool in _types(info) else _unit(info) or "N"


@contextmanager
def as_options() -> Iterator[None]:
    """Rewrite complaints of plug-ins about a parameter, ``.rate: ...``, for an option,
    ``--rate: ...``."""
    try:
        yield
    except InputError as error:
        raise InputError(*map(_for_option, map(str, error.args))) from error


def _for_option(line: str) -> str:
    key, colon, text = line.partition(":")
    return f"{_option(key[1:])}{colon}{text}" if line.startswith(".") else line
