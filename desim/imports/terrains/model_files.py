"""Files that a Gazebo world names: models and meshes beside it, or where Gazebo searches them."""

from __future__ import annotations

import os
from pathlib import Path, PurePosixPath
from typing import NamedTuple

from desim import outside_xml
from desim.files import content_below
from desim.outside_xml import Element

_MOST_BYTES = 100_000_000
_MODELS = "models"  # the folder of models, below the world's own folder or beside it
_SEARCHED = ("GZ_SIM_RESOURCE_PATH", "GAZEBO_MODEL_PATH")  # variables: folders of models


class ModelFolder(NamedTuple):
    """A folder in which names are looked up: ``below`` a root that they cannot leave."""

    root: Path
    below: str = ""

    def file(self, name: str) -> str:
        return f"{self.below}/{name}" if self.below else name


class ModelFiles:
    """The files that can be found. Below their roots no link is followed."""

    def __init__(self, world: Path) -> None:
        here = world.absolute().parent
        self.here = ModelFolder(here)
        self._places = [self.here, ModelFolder(here, _MODELS), ModelFolder(here.parent, _MODELS)]
        if here.parent.name == _MODELS:  # a model alone, which names itself
            self._places.append(ModelFolder(here.parent))
        self._places += [ModelFolder(Path(folder)) for name in _SEARCHED
                         for folder in os.environ.get(name, "").split(os.pathsep) if folder]
        self._read: dict[tuple[ModelFolder, str], bytes] = {}

    def content(self, uri: str, own: ModelFolder) -> tuple[ModelFolder, str, bytes]:
        """A file: the folder that it is in, its name and what it holds. A relative path begins at
        the folder ``own`` of the file that names it. Raises ``OSError`` and ``ValueError``."""
        scheme, _, name = uri.rpartition("://")
        if scheme in ("http", "https"):  # of Fuel: a copy beside the world
            name = name.rpartition("/models/")[2]
        elif scheme == "file":
            name = name.removeprefix(f"{_MODELS}/")
        elif scheme not in ("", "model", "package"):
            raise ValueError(f"{scheme}:// is not read")
        missing: OSError = FileNotFoundError(uri)
        for place in self._places if scheme else [own, *self._places]:
            path = PurePosixPath(place.file(name))
            try:
                if (place, name) not in self._read:
                    self._read[place, name] = content_below(place.root, str(path), _MOST_BYTES)
                folder = "" if str(path.parent) == "." else str(path.parent)
                return ModelFolder(place.root, folder), path.name, self._read[place, name]
            except OSError as error:
                missing = missing if isinstance(error, FileNotFoundError) else error
        raise missing

    def model(self, uri: str, own: ModelFolder) -> tuple[ModelFolder, str, Element]:
        """The model of a folder, or of a file .sdf: its folder, its file and its root. Raises
        ``OSError``, ``ValueError`` and ``InputError``."""
        uri = uri.rstrip("/")
        try:
            place, name, content = self.content(
                uri if uri.endswith((".sdf", ".world")) else f"{uri}/model.sdf", own)
        except FileNotFoundError:  # another name, which the newest version in model.config has
            place, name, content = self.content(f"{uri}/model.config", own)
            *_, newest = outside_xml.parse(name, content).all("sdf")
            place, name, content = self.content(newest.text.strip(), place)
        where = str(place.root / place.file(name))
        return place, where, outside_xml.parse(where, content)
