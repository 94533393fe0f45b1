"""The scenarios that are shipped with desim: their questions, and the files that each needs."""

from __future__ import annotations

import os
import re
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

from desim.errors import InputError, did_you_mean
from desim.scenario import yaml12

_PACKAGE = Path(__file__).parents[1]


class Shipped(NamedTuple):
    """A shipped file: ``hello`` or ``studies/bandwidth``, and the question that it opens with."""

    name: str
    question: str
    command: str  # that plays it


def folder() -> Path:
    """The folder of the shipped scenarios: in the wheel beside the modules, in a checkout at its
    top."""
    installed = _PACKAGE / "scenarios"
    return installed if installed.is_dir() else _PACKAGE.parent / "scenarios"


def found(path: Path) -> Path:
    """The file that a user calls ``path``: that, the same with ``.yaml``, or a shipped one. Where
    there is none, ``path``."""
    named = f"{path}.yaml"
    return next((file for file in (path, Path(named), folder() / named) if os.path.exists(file)),
                path)


def shipped() -> list[Shipped]:
    """All shipped files: scenarios, those with real programs, designs, layouts of networks."""
    paths = sorted(folder().rglob("*.yaml"), key=lambda path: (
        len(path.relative_to(folder()).parts), path.relative_to(folder())))
    found = [Shipped(path.relative_to(folder()).with_suffix("").as_posix(), question(path),
                     _command(path)) for path in paths]
    order = ["desim run", "desim loop", "desim sweep", "desim net layout"]
    return sorted(found, key=lambda one: order.index(one.command))


def question(path: Path) -> str:
    """The first sentence of the comment that a file opens with."""
    lines = path.read_text("utf-8").splitlines()
    comment = []
    for line in lines:
        if not line.startswith("# "):
            break
        comment.append(line[2:])
    return re.split(r"(?<=[.?:]) (?!\d)", f"{' '.join(comment)} ")[0].strip().rstrip(":.")


def belongings(name: str) -> list[Path]:
    """The shipped file called ``name`` and all that it refers to, itself first, as paths relative
    to ``folder()``. Raises ``InputError`` where there is none of this name."""
    known = [one.name for one in shipped()]
    name = name.removeprefix("scenarios/").removesuffix(".yaml")
    if name not in known:
        same = [one for one in known if one.endswith(f"/{name}")]
        meant = f" (did you mean {same[0]!r}?)" if same else did_you_mean(name, known)
        raise InputError(f"no scenario {name!r} is shipped{meant}; desim new lists all "
                         f"{len(known)}")
    top, found = folder().resolve(), [folder().resolve() / f"{name}.yaml"]
    for file in found:  # it grows
        found += [other for other in _references(file)
                  if other not in found and other.is_relative_to(top)]
    return [file.relative_to(top) for file in found]


def _references(file: Path) -> Iterator[Path]:
    """The files that the texts of a YAML file name: by path, or as the module of a dotted path; and
    those of the folders in which its real programs start."""
    if file.suffix != ".yaml":
        return
    content = yaml12.read(os.fspath(file))[0]
    for program in content.get("loop", {}).get("programs", []):
        if "folder" in program:
            yield from sorted((file.parent / program["folder"]).resolve().glob("*.*"))
    for text in _texts(content):
        for name in (text, f"{text.partition(':')[0]}.py"):
            if "\0" not in name and len(name) < 200 and (file.parent / name).is_file():
                yield (file.parent / name).resolve()


def _texts(value: object) -> Iterator[str]:
    if isinstance(value, str):
        yield value
    elif isinstance(value, dict | list):
        for below in value.values() if isinstance(value, dict) else value:
            yield from _texts(below)


def _command(path: Path) -> str:
    if path.parent.name == "layouts":
        return "desim net layout"
    if path.parent.name == "loop":
        return "desim loop"
    return "desim sweep" if _is_design(path) else "desim run"


def _is_design(path: Path) -> bool:
    """Whether a file, or one that it extends, has a base: a scenario has none."""
    keys = dict(re.findall(r"^(base|extends): *(\S+)", path.read_text("utf-8"), re.MULTILINE))
    return "base" in keys or "extends" in keys and _is_design(path.parent / keys["extends"])
