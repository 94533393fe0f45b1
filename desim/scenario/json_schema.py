"""The JSON Schema of a scenario, with which editors complete and check one while it is written."""

from __future__ import annotations

from pydantic.json_schema import models_json_schema

from desim import plugins
from desim.errors import InputError
from desim.ports import Params
from desim.scenario.merge import CHOICES
from desim.scenario.schema.communication import (
    Coordination,
    MediumChoice,
    MiddlewareChoice,
    PluginChoice,
    RuleChoice,
    StrategyChoice,
)
from desim.scenario.schema.experiment import TaskChoice
from desim.scenario.schema.robot import LocalizationChoice
from desim.scenario.schema.scenario import Scenario
from desim.scenario.source_places import Data

_CHOICES: tuple[type[PluginChoice], ...] = (
    MediumChoice, RuleChoice, MiddlewareChoice, Coordination, StrategyChoice, TaskChoice,
    LocalizationChoice)
_ALONE = {"type": "string", "title": "name", "description": "a plug-in by its name alone"}


def json_schema() -> Data:
    """Draft 2020-12. A plug-in's own parameters are known where its name is that of an installed
    one; a dotted path may have any."""
    blocks = {(choice.kind, name): block for choice in _CHOICES
              for name, block in _blocks(choice.kind).items()}
    models: list[type[Params]] = [Scenario, *blocks.values(), *_CHOICES]
    references, whole = models_json_schema([(model, "validation") for model in models],
                                           by_alias=True)
    definitions = whole["$defs"]
    names = {model: reference["$ref"].rpartition("/")[2]
             for (model, _), reference in references.items()}
    root = definitions[names[Scenario]]
    for choice in _CHOICES:
        key = choice.name_key
        own = definitions[names[choice]]
        alternatives = [_alternative(own, key, name, definitions[names[block]])
                        for (kind, name), block in blocks.items() if kind == choice.kind]
        alone = [_ALONE] * (choice in CHOICES.values())
        definitions[names[choice]] = {
            "description": own.get("description", ""),
            "anyOf": [*alternatives, _dotted(own, key), _unnamed(own, key), *alone]}
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", "title": "desim scenario",
            **{key: value for key, value in root.items() if key not in ("title", "required")},
            "anyOf": [{"required": root["required"]}, {"required": ["extends"]}],
            "properties": {"extends": {"type": "string", "description":
                                       "a scenario file that this one is laid over"},
                           **root["properties"]},
            "$defs": dict(sorted(definitions.items()))}


def _blocks(kind: str) -> dict[str, type[Params]]:
    """Name to parameters of the installed plug-ins; one that cannot be loaded is left out."""
    found = {}
    for name in plugins.available(kind):
        try:
            found[name] = plugins.parameters(kind, name)
        except InputError:
            continue
    return found


def _alternative(own: Data, key: str, name: str, params: Data) -> Data:
    chosen = {**own["properties"][key], "const": name}
    return {"type": "object", "title": name, "description": params.get("description", ""),
            "properties": {**own["properties"], **params.get("properties", {}), key: chosen},
            "required": sorted({*own.get("required", []), *params.get("required", [])}),
            "additionalProperties": False}


def _dotted(own: Data, key: str) -> Data:
    chosen = {**own["properties"][key], "pattern": ":"}
    return {"type": "object", "title": "package.module:Class", "additionalProperties": True,
            "description": "a plug-in by its dotted path, with its own parameters",
            "properties": {**own["properties"], key: chosen}, "required": [key]}


def _unnamed(own: Data, key: str) -> Data:
    return {"type": "object", "title": f"without {key}", "additionalProperties": True,
            "description": "parameters of the plug-in that the deployment or `extends` names",
            "properties": {name: value for name, value in own["properties"].items()
                           if name != key},
            "not": {"required": [key]}}
