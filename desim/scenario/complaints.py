"""Complaints in the user's words, from pydantic's errors: what is wrong, what is allowed."""

from __future__ import annotations

import json
from typing import Annotated, Any, Literal, NamedTuple, TypeVar, get_args, get_origin

from pydantic import PlainSerializer, ValidationError
from pydantic.fields import FieldInfo
from pydantic_core import ErrorDetails

from desim.errors import did_you_mean
from desim.ports import Constants, Params
from desim.scenario.schema.communication import PluginChoice, RuleChoice
from desim.scenario.schema.shapes import alternatives, keys, without_null
from desim.scenario.source_places import Path, Places, SourcePlace, dotted

MOST_SHOWN = 20
Location = tuple[int | str, ...]  # of one of pydantic's errors
P = TypeVar("P", bound=Params)


class Complaint(NamedTuple):
    """One thing that is wrong, at ``path`` of the data; ``at_key``: the key itself is wrong."""

    path: Path
    text: str
    at_key: bool = False

    def line(self, places: Places) -> str:
        """``file:line:column: path: text``."""
        return ": ".join(filter(None, (str(self.place(places)), dotted(self.path), self.text)))

    def place(self, places: Places) -> SourcePlace:
        return places.key(self.path) if self.at_key else places.value(self.path)


def lines(found: list[Complaint], places: Places) -> list[str]:
    """The lines of all complaints, each once, in the order of the files; of very many the first
    ones, and the number of the others."""
    all_lines = list(dict.fromkeys(complaint.line(places) for complaint in sorted(
        found, key=lambda complaint: complaint.place(places))))
    more = len(all_lines) - MOST_SHOWN
    return all_lines if more <= 0 else [*all_lines[:MOST_SHOWN],
                                        f"and {more} more thing{'s' * (more > 1)} that "
                                        f"{'are' if more > 1 else 'is'} wrong"]


def validated(block: type[P], data: object) -> P | list[Complaint]:
    """An instance of ``block`` from ``data``, or all that is wrong with it."""
    try:
        # As JSON: strict about numbers, text and truth values, and a list may become a tuple.
        return block.model_validate_json(json.dumps(data), strict=True)
    except ValidationError as error:
        return complaints_of(error, block, data)


def complaints_of(error: ValidationError, block: type[Params], data: object, path: Path = (),
                  more: tuple[str, ...] = ()) -> list[Complaint]:
    """The complaints that pydantic's ``error`` about ``data``, meant as a ``block``, comes to.

    ``data`` stands at ``path``; ``more`` are keys that are allowed beside the block's own.
    """
    found = [(wrong, _complaint(block, data, path, more, wrong))
             for wrong in error.errors(include_url=False)]
    texts = {(complaint.path[:-1], complaint.text.partition("?")[0]) for _, complaint in found}
    return [complaint for wrong, complaint in found if not _follows(wrong, data, complaint, texts)]


def _follows(error: ErrorDetails, data: object, complaint: Complaint,
             texts: set[tuple[Path, str]]) -> bool:
    """Whether this error is only the consequence of another one."""
    if error["type"] == "missing":  # its key is there, misspelt
        meant = f"unknown key{did_you_mean(str(error['loc'][-1]), [str(error['loc'][-1])])}"
        return (complaint.path, meant.partition("?")[0]) in texts
    # pydantic does not count wrong items as items
    return (error["type"] == "too_short" and
            len(_at(data, _own(error["loc"]))) >= error["ctx"]["min_length"])


def _complaint(block: type[Params], data: object, base: Path, more: tuple[str, ...],
               error: ErrorDetails) -> Complaint:
    location = tuple(step for step in error["loc"] if step != "[key]")
    own = _own(location)
    path = (*base, *own)
    kind, context = error["type"], error.get("ctx", {})
    if kind == "extra_forbidden":
        around = _block(block, location[:-1])
        known = [*(more if len(own) == 1 else ()), *keys(around)]
        text = (f": it is one of the constants, so write constants: {{{own[-1]}: ...}}"
                if own[-1] in _constants(around) else
                f"{did_you_mean(str(own[-1]), known)}; allowed: {', '.join(known)}" if known
                else "; it has no parameters")
        return Complaint(path, f"unknown key{text}", at_key=True)
    if kind == "missing":
        return _missing(block, data, base, location)
    if kind == "value_error":
        return Complaint(path, str(context["error"]))
    if "[key]" in error["loc"]:
        return Complaint(path, _pattern_rule(str(own[-1]), context), at_key=True)
    given = _short(_at(data, own))
    if kind == "union_tag_not_found" and isinstance(_at(data, own), dict):
        given += f" with {', '.join(map(str, _at(data, own)))}"
    if kind == "literal_error":
        options = _options(_annotation(block, location))
        guess = did_you_mean(str(_at(data, own)), options)
        return Complaint(path, f"{given} is not allowed{guess}; allowed: {', '.join(options)}")
    if kind == "string_pattern_mismatch":
        return Complaint(path, _pattern_rule(_at(data, own), context))
    text = _BOUNDS[kind].format(**{name: _limit(limit, block, location)
                                   for name, limit in context.items()}) if kind in _BOUNDS else (
        _wanted(_annotation(block, location)))
    return Complaint(path, f"must be {text}, got {given}")


_BOUNDS = {
    "greater_than": "above {gt}",
    "greater_than_equal": "at least {ge}",
    "less_than": "below {lt}",
    "less_than_equal": "at most {le}",
    "string_too_short": "text of at least {min_length} character",
    "too_short": "a list of at least {min_length}",
    "too_long": "a list of at most {max_length}",
    "finite_number": "a finite number",
}


def _limit(limit: Any, block: type[Params], location: Location) -> str:
    """A limit of the value at a location, as it is written there: with a unit, if it has one."""
    around = without_null(_annotation(block, location[:-1]))[0]
    if isinstance(around, type) and issubclass(around, Params) and not isinstance(limit, str):
        field = _field(around, location[-1])
        marks = [*field.metadata, *(mark for shape in without_null(field.annotation)
                                    for mark in get_args(shape)[1:])]
        writers: list[Any] = [mark.func for mark in marks if isinstance(mark, PlainSerializer)]
        if writers:
            limit = writers[0](float(limit))
    return f"{limit:g}" if isinstance(limit, float) else str(limit)  # with all digits


def _constants(block: type[Params]) -> list[str]:
    """The names of the constants that a block's ``constants`` may change."""
    return [key for info in block.model_fields.values() if isinstance(info.annotation, type)
            and issubclass(info.annotation, Constants) for key in keys(info.annotation)]


def _missing(block: type[Params], data: object, base: Path, location: Location) -> Complaint:
    own = _own(location)
    if isinstance(own[-1], int):
        return Complaint((*base, *own[:-1]), f"must be {_wanted(_annotation(block, location[:-1]))}"
                                             f", got {_short(_at(data, own[:-1]))}")
    info = _field(_block(block, location[:-1]), own[-1])
    about = f": {info.description}" if info.description else ""
    return Complaint((*base, *own[:-1]), f"the key {own[-1]!r} is missing{about}", at_key=True)


def _pattern_rule(text: str, context: dict[str, object]) -> str:
    return f"{_short(text)} is not allowed; allowed: text that matches {context['pattern']}"


_NAMES = {str: "text", int: "a whole number", float: "a number", bool: "true or false",
          dict: "a mapping", tuple: "a list", list: "a list"}


def _wanted(annotation: object) -> str:
    """A description of the values of this type, for people."""
    texts = []
    for shape in alternatives(annotation).values() or without_null(annotation):
        origin, inside = get_origin(shape), get_args(shape)
        if isinstance(shape, type) and issubclass(shape, Params):
            named = "a plug-in's name, or " * (issubclass(shape, PluginChoice)
                                               and shape is not RuleChoice)
            texts.append(f"{named}a mapping with {', '.join(keys(shape))}")
        elif origin is tuple and inside[-1] is not Ellipsis:
            texts.append(f"a list of {len(inside)}")
        else:
            texts.append(next((name for kind, name in _NAMES.items() if kind is (origin or shape)),
                              "something else"))
    return ", or ".join(texts)


def _annotation(block: type[Params], location: Location) -> object:
    """The type that stands at a location of a validation error."""
    here: object = block
    for step in location:
        if get_origin(here) is Annotated:  # inside of a mapping's or a list's type
            here = get_args(here)[0]
        options = alternatives(here)
        if options:
            here = options[str(step)]
            continue
        here = without_null(here)[0]
        inside = get_args(here)
        if get_origin(here) is dict:
            here = inside[1]
        elif get_origin(here) is list:
            here = inside[0]
        elif get_origin(here) is tuple:
            each = inside[-1] is Ellipsis
            here = inside[0] if each else inside[min(int(step), len(inside) - 1)]
        elif isinstance(here, type) and issubclass(here, Params):
            here = _field(here, step).annotation
    return here


def _block(block: type[Params], location: Location) -> type[Params]:
    """The parameter block that stands at a location."""
    found = without_null(_annotation(block, location))[0]
    assert isinstance(found, type)
    assert issubclass(found, Params)
    return found


def _field(block: type[Params], key: int | str) -> FieldInfo:
    return next(field for name, field in block.model_fields.items()
                if key == (field.alias or name))


def _options(annotation: object) -> list[str]:
    return list(get_args(next(option for option in without_null(annotation)
                              if get_origin(option) is Literal)))


def _own(location: Location) -> Path:
    """The location as a path in the user's data: without the tags of shapes."""
    return tuple(step for step in location if not str(step).startswith("\0"))


def _at(data: Any, path: Path) -> Any:
    for step in path:
        data = data[step]
    return data


def _short(value: object) -> str:
    text = ("a mapping" if isinstance(value, dict) else
            f"a list of {len(value)}" if isinstance(value, list) else
            json.dumps(value) if isinstance(value, bool | None) else repr(value))
    return text if len(text) <= 60 else text[:57] + "..."
