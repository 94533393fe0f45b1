"""The replay page: the bundles of one or two runs, the scripts and the style, in one file."""

from __future__ import annotations

import json
import re
from collections.abc import Sequence
from importlib.resources import files
from pathlib import Path

from desim.files import target
from desim.report.replay.bundle import bundle
from desim.results.comparison import ComparedRuns, Parting
from desim.results.recording import Recording

# In the order in which the page reads them.
SCRIPTS = ("data/sorted", "data/columns", "data/tables", "data/run", "data/words",
           "data/selection", "data/comparison", "data/growth", "data/traffic", "data/beliefs",
           "canvas/palette", "canvas/camera", "canvas/layer", "canvas/labels", "canvas/shapes",
           "scene/rays", "scene/terrain", "scene/ground", "scene/fans", "scene/near_by",
           "scene/paths",
           "scene/plans", "scene/hosts", "scene/access_points", "scene/links", "scene/loads",
           "scene/flights", "scene/queues", "scene/believed", "scene/robots", "scene/busy",
           "scene/names", "scene/scale_bar", "scene/believed_poses",
           "scene/tethers", "scene/scene", "panel/series", "panel/chart", "panel/matrix",
           "panel/message_list", "panel/event_list", "panel/panel", "page/player", "page/timeline",
           "page/hint", "page/stage", "page/keyboard", "page/help", "page/live", "page/page")
STYLES = ("page/theme", "page/layout")
_PLACE = re.compile(r"^\S*/(?=[\w.]+:\w+$)")  # of a plug-in
_NOT_NAMED = ("name", "seed", "trace")  # keys that need not be named where two runs differ


def write(recordings: Sequence[Recording], path: Path) -> None:
    """Write the page of one or two runs to ``path``. Raises ``InputError`` for a file that cannot
    be written."""
    page = page_of(recordings)
    with target(path, "--to") as beside:
        beside.write_text(page, encoding="utf-8")


def page_of(recordings: Sequence[Recording]) -> str:
    """The page of one run or two."""
    if len(recordings) == 1:
        return page([_bundled(recordings[0], [], None)])
    compared = ComparedRuns(*(recording.run for recording in recordings))
    keys = [key for key in compared.keys
            if key.key.partition(".")[0] not in _NOT_NAMED]
    values = [[key.first for key in keys], [key.second for key in keys]]
    apart = [[f"{key.key} {'none' if value is None else _PLACE.sub('', str(value))}"
              for key, value in zip(keys, own, strict=True)] for own in values]
    return page([_bundled(recording, own, compared.parted)
                 for recording, own in zip(recordings, apart, strict=True)])


def _bundled(recording: Recording, apart: Sequence[str], parted: Parting | None) -> str:
    """The elements of a page that hold one run. ``apart``: the keys of its scenario that
    differ from the other run's, with their values here."""
    about, columns = bundle(recording)
    about |= {"columns": columns.index, "apart": list(apart),
              "parted": parted._asdict() if parted else None}
    # "</script>" in a name would end the element.
    head = json.dumps(about, allow_nan=False).replace("<", "\\u003c")
    return (f'<script type="application/json" class="run-about">{head}</script>\n'
            f'<script type="text/plain" class="run-columns">{columns.text()}</script>\n')


def page(runs: Sequence[str]) -> str:
    """A page of the elements that hold its runs; without any it asks its server for a stream of
    chunks (``desim/report/live``)."""
    script = "\n".join(_asset(f"{name}.js") for name in SCRIPTS)
    parts = {"style": "\n".join(_asset(f"{name}.css") for name in STYLES), "runs": "".join(runs),
             "script": f'(() => {{\n"use strict";\n{script}\n}})();'}
    return re.sub(r"\{\{(\w+)\}\}", lambda found: parts[found[1]], _asset("page/replay.html"))


def _asset(name: str) -> str:
    return files("desim.report.replay").joinpath("assets", name).read_text("utf-8")
