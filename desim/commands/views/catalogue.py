"""The catalogue of plug-ins: a list of all, and the description of each."""

from __future__ import annotations

import inspect
import re
from collections.abc import Iterator, Mapping
from typing import Literal, get_args, get_origin

from pydantic import WithJsonSchema
from pydantic.fields import FieldInfo

from desim import plugins
from desim.errors import InputError, did_you_mean
from desim.ports import Named, Params, function_rule, with_scope
from desim.ports.cases import ShowsSettings
from desim.scenario.schema.generated import GENERATED
from desim.world.paper_terrains import ABOUT

_LONG = 120  # characters of a sentence in a list


def listing() -> str:
    """All plug-ins by kind, each with the first sentence of its own description."""
    lines = []
    for kind, group in plugins.GROUPS.items():
        points = plugins.available(kind)
        if points:
            lines.append(f"{kind} ({group})")
            width = max(map(len, points))
            lines += [f"  {name:<{width}}  {first_sentence(kind, name)}" for name in points]
    lines.append("terrain (of environment.terrain)")
    return "\n".join([*lines, *(f"  {name:<9}  {_sentence(text)}"
                                for name, text in _terrain_texts())])


def description(name: str) -> str:
    """The plug-in's documentation and its parameters. Raises ``InputError`` if there is none."""
    kinds = [kind for kind in plugins.GROUPS if name in plugins.available(kind)]
    if not kinds and ":" in name:
        cls = plugins.imported("plug-in", name)
        if inspect.isfunction(cls):
            return _about(name, "rule", function_rule(cls))
        if not inspect.isclass(cls):
            raise InputError(f"{name!r} is not a plug-in: it names a {type(cls).__name__}, and "
                             "a plug-in is a class")
        return _about(name, "plug-in", cls)
    terrains = [*_about_terrain(name), *([] if kinds else _about_choice(name))]
    if not kinds and not terrains:
        known = [*(known for kind in plugins.GROUPS for known in plugins.available(kind)),
                 *dict.fromkeys(known for known, _ in _terrain_texts())]
        near = did_you_mean(name, [*known, *(one for _, _, names in _choices() for one in names)])
        raise InputError(f"unknown plug-in {name!r}{near}; desim plugins lists all {len(known)}, "
                         "or write a dotted path 'package.module:Class'")
    return "\n\n".join([*(_about(name, kind, plugins.load(kind, name)) for kind in kinds),
                        *terrains])


def first_sentence(kind: str, name: str) -> str:
    """The first sentence of a plug-in's documentation."""
    try:
        text = " ".join((inspect.getdoc(plugins.load(kind, name)) or "").split())
    except (ImportError, AttributeError, InputError) as error:
        return f"(cannot be loaded: {error})"
    return _sentence(text)


def _sentence(text: str) -> str:
    return f"{_shortened(re.split(r'[.] ', text.rstrip('.') + '. ')[0])}."


def _shortened(sentence: str) -> str:
    """A long sentence up to its first colon or semicolon outside of code; others as they are."""
    if len(sentence) <= _LONG:
        return sentence
    return next((sentence[:mark.start()] for mark in re.finditer("[:;] ", sentence)
                 if sentence.count("``", 0, mark.start()) % 2 == 0), sentence)


def _terrain_texts() -> Iterator[tuple[str, str]]:
    """Name and description of each terrain: of the built-in ones, then of the generated ones."""
    for name, text in ABOUT.items():
        yield name, f"{text.rstrip('.')}, 80 m x 80 m (the paper)."
    for name, block in GENERATED.items():
        yield name, " ".join((inspect.getdoc(block) or "").split())


def _about_terrain(name: str) -> Iterator[str]:
    if name in ABOUT:
        text = next(text for known, text in _terrain_texts() if known == name)
        yield f"{name} (terrain): environment.terrain: {name}\n\n{text}\n\nno parameters"
    if name in GENERATED:
        yield "\n".join([
            f"{name} (generated terrain): environment.terrain: {{{name}: ...}}", "",
            inspect.getdoc(GENERATED[name]) or "", "", "parameters:",
            *_parameters(GENERATED[name].model_fields, "  ")])


def _about(name: str, kind: str, cls: type) -> str:
    lines = [f"{name} ({kind}): {cls.__module__}:{cls.__qualname__}", "",
             inspect.getdoc(cls) or "(it says nothing about itself)"]
    reasons = getattr(cls, "reasons", ())
    if reasons:
        lines += ["", f"drops for: {', '.join(reasons)}"]
    params = getattr(cls, "Params", None)
    if kind == "rule" and params is not None:
        params = with_scope(params)
    fields = params.model_fields if params is not None else {}
    lines += ["", "parameters:" if fields else "no parameters"]
    lines += _parameters(fields, "  ")
    for key, names in (params.meanings if params is not None else {}).items():
        lines += ["", f"{key}:", *(line for name, one in names.items()
                                   for line in _named(name, one))]
    return "\n".join(lines)


def _choices() -> Iterator[tuple[str, str, Mapping[str, Named]]]:
    """The networks, their parameters that choose sets of values, and the names of these."""
    for plugin in plugins.available("network"):
        for key, names in plugins.parameters("network", plugin).meanings.items():
            yield plugin, key, names


def _about_choice(name: str) -> Iterator[str]:
    """A name of a choice, as a card: the device with its source, and all values that a radio has
    then, its blocks but those that it gives left out."""
    for plugin, key, names in _choices():
        if name not in names:
            continue
        block, given = plugins.parameters("network", plugin), names[name].values
        params = block.model_validate({key: name})
        values = params.model_dump(mode="json", by_alias=True, exclude_none=True)
        shown = params.shown() if isinstance(params, ShowsSettings) else {}
        lines = [f"{name} ({key} of {plugin}): {{model: {plugin}, {key}: {name}}}", "",
                 f"{names[name].about}.", "", "values:"]
        for own, value in {**values, **shown}.items():
            if own in given and isinstance(value, dict):
                lines.append(f"  {own}: {_value(given[own])}")
            elif own != key and not isinstance(value, dict | list):
                lines.append(f"  {own}: {_value(value)}"
                             + ("" if own in {**given, **shown} else "  (default)"))
        yield "\n".join(lines)


def _named(name: str, one: Named) -> list[str]:
    """A name of a choice: the thing that it stands for, and the values that it gives."""
    values = ", ".join(f"{key}: {_value(value)}" for key, value in one.values.items())
    return [f"  {name}: {one.about}.", f"    {{{values}}}"]


def _value(value: object) -> str:
    """As it stands in YAML."""
    if isinstance(value, dict):
        return "{" + ", ".join(f"{key}: {_value(one)}" for key, one in value.items()) + "}"
    return str(value)


def _parameters(fields: dict[str, FieldInfo], indent: str) -> Iterator[str]:
    """A line a parameter; those of a block stand below it."""
    for name, info in fields.items():
        default = None if info.is_required() else info.get_default(call_default_factory=True)
        says = "" if isinstance(default, Params) else f" {_default(info)} "
        about = "; ".join(filter(None, (info.description, _unnamed(info))))
        yield f"{indent}{info.alias or name}:{says} {about}".rstrip()
        yield from _parameters(_block(info.annotation), indent + "  ")


def _unnamed(info: FieldInfo) -> str:
    """The names that a choice allows, where its description has not all of them."""
    names = [one for kind in (info.annotation, *get_args(info.annotation))
             if get_origin(kind) is Literal for one in get_args(kind) if isinstance(one, str)]
    if all(name in (info.description or "") for name in names):
        return ""
    return f"one of {', '.join(names)}"


def _block(annotation: object) -> dict[str, FieldInfo]:
    """The parameters of a field that is a block, or a block or none."""
    for kind in (annotation, *get_args(annotation)):
        if inspect.isclass(kind) and issubclass(kind, Params):
            return kind.model_fields
    return {}


def _example(info: FieldInfo) -> object:
    """The example of a field, or of its kind of quantity; None if there is neither."""
    of_kind = (schema for kind in info.metadata if isinstance(kind, WithJsonSchema)
               and kind.json_schema is not None
               for schema in (kind.json_schema, *kind.json_schema.get("anyOf", ())))
    given = (info.examples, *(schema.get("examples") for schema in of_kind))
    return next((examples[0] for examples in given if examples), None)


def _default(info: FieldInfo) -> str:
    if info.is_required():
        example = _example(info)
        return "must be given." if example is None else f"must be given, e.g. {example!r}."
    return f"default {info.get_default(call_default_factory=True)!r}."
