"""The copy of its design that a campaign's folder keeps."""

from __future__ import annotations

import os
import pathlib

from desim import plugins
from desim.campaign.design.design import LoadedDesign
from desim.campaign.design.file_paths import FilePaths
from desim.errors import InputError
from desim.files import content_below, reading, refuse_link, replacing
from desim.scenario import yaml12
from desim.scenario.source_places import Path

DESIGN = "design.yaml"
_ABOUT = """\
# The design of this campaign, every default spelled out, paths relative to this file.
# desim sweep THIS_FILE --out ANOTHER_FOLDER repeats the campaign.
"""


def kept_design(folder: pathlib.Path) -> pathlib.Path:
    """The file of the design in a campaign's folder. Raises ``InputError`` for a link."""
    file = folder / DESIGN
    with reading(file):
        refuse_link(file)
    return file


def store(loaded: LoadedDesign, folder: pathlib.Path) -> None:
    """Keep the design in ``folder``, in place of an earlier one of the same name. The new design
    may add values, and takes over the runs that still belong to it. Raises ``InputError`` if the
    folder has another campaign, ``OSError`` if nothing can be written."""
    refuse_another(loaded, folder)
    text = _ABOUT + yaml12.dump(_data(loaded, os.path.realpath(folder)))
    file = kept_design(folder)
    if not file.exists() or content_below(folder, DESIGN, yaml12.MOST_BYTES) != text.encode():
        with replacing(file) as beside:
            beside.write_bytes(text.encode())


def refuse_another(loaded: LoadedDesign, folder: pathlib.Path) -> None:
    """Refuse a ``folder`` that has a design of another name. Raises ``InputError``."""
    file = kept_design(folder)
    if not file.exists():
        return
    try:
        name = yaml12.read(os.fspath(file))[0].get("name")
    except InputError as error:
        raise InputError(*error.args, f"{file}: says no longer whose campaign is in this folder; "
                         "if it is this one, remove the file") from None
    if name != loaded.design.name:
        raise InputError(f"{folder}: holds the campaign {name!r}, the design's name is "
                         f"{loaded.design.name!r}; choose another folder with --out")


def _data(loaded: LoadedDesign, folder: str) -> dict[str, object]:
    paths = FilePaths(loaded)

    def moved(value: object, path: Path) -> object:
        if isinstance(value, dict):
            return {key: moved(below, (*path, key)) for key, below in value.items()}
        if isinstance(value, list):
            return [moved(below, (*path, i)) for i, below in enumerate(value)]
        if not isinstance(value, str):
            return value
        moved_to = _relative(value, os.path.realpath(loaded.folder(path)), folder)
        return moved_to if moved_to != value and paths.has(path, value) else value

    data = {key: moved(value, (key,)) for key, value in
            loaded.design.model_dump(mode="json", by_alias=True).items()}
    base = os.path.join(os.path.realpath(loaded.folder(("base",))), loaded.design.base)
    return {**data, "base": os.path.relpath(base, folder)}


def _relative(value: str, here: str, folder: str) -> str:
    """The path of a file or module that stands ``here``, made relative to ``folder``; other text as
    it is."""
    module = plugins.beside(value, here)
    if module != value:
        return os.path.relpath(module, folder)
    file = os.path.join(here, value)
    return os.path.relpath(file, folder) if os.path.isfile(file) else value
