"""A complete scenario as text: everything is spelled out, and loading it gives the same run."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Callable, Mapping

from desim.errors import InputError
from desim.files import content
from desim.scenario import plugin_choices, yaml12
from desim.scenario.interrupts import interruptible
from desim.scenario.schema.environment import MapFile
from desim.scenario.schema.scenario import Scenario
from desim.scenario.source_places import Data


def resolved(scenario: Scenario, folder: str | os.PathLike | None = None) -> str:
    """YAML of a loaded scenario, in the order of the schema, quantities with their units.

    The paths of a map and of plug-ins' modules and files are absolute, or relative to ``folder``,
    where the text will be stored.
    """
    return yaml12.dump(_data(scenario, _dumped(scenario), lambda path: path if folder is None else
                             os.path.relpath(path, folder)))


def scenario_id(scenario: Scenario, versions: Mapping[str, str]) -> Callable[[int], str]:
    """The 12 hex digits that name the scenario's run with a seed: of the scenario, of the content
    of its map and of its plug-ins' files (wherever they lie), and of the versions that it runs
    with."""
    digest, data = hashlib.sha256(), _dumped(scenario)
    for file in _files(scenario, data):
        digest.update(hashlib.sha256(_content(file)).digest())
    digest.update(json.dumps({**_data(scenario, data, os.path.basename), "seed": 0}).encode())
    digest.update(repr(sorted(versions.items())).encode())

    def with_seed(seed: int) -> str:
        complete = digest.copy()
        complete.update(str(seed).encode())
        return complete.hexdigest()[:12]

    return with_seed


def _content(file: str) -> bytes:
    try:
        return content(file, plugin_choices.MOST_BYTES)
    except OSError as error:
        raise InputError(f"{file}: {error.strerror}") from error


def _dumped(scenario: Scenario) -> Data:
    with interruptible():
        return scenario.model_dump(mode="json", by_alias=True)


def _data(scenario: Scenario, data: Data, written: Callable[[str], str]) -> Data:
    """As a file has it, with each absolute path as ``written`` gives it."""
    if isinstance(scenario.environment.terrain, MapFile):
        terrain = data["environment"]["terrain"]
        terrain["map"] = written(terrain["map"])
    for _, mapping, key, _ in plugin_choices.path_values(data):
        if os.path.isabs(mapping[key]):
            mapping[key] = written(mapping[key])
    return data


def _files(scenario: Scenario, data: Data) -> list[str]:
    """All that it names, as far as they exist: what is wrong with them is for others to say."""
    files = [mapping[key] for _, mapping, key, is_file in plugin_choices.path_values(data)
             if is_file]
    if isinstance(scenario.environment.terrain, MapFile):
        files = _map_files(scenario.environment.terrain) + files
    return [file for file in files if os.path.isfile(file)]


def _map_files(terrain: MapFile) -> list[str]:
    """The map's YAML file and its image."""
    try:
        facts, _ = yaml12.read(terrain.map)
    except InputError:
        facts = {}
    image = os.path.join(os.path.dirname(terrain.map), str(terrain.image or facts.get("image")))
    return [terrain.map, image]
