"""A run as a short animation for slides: terrain, robots, what they have explored, and messages."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
from PIL import Image

from desim.errors import InputError
from desim.export.animation.scene import AnimationScene
from desim.files import target
from desim.results.recording import Recording
from desim.units import NS_PER_S

_PICTURES_PER_S = 10
_FASTER, _SHORTEST_S, _LONGEST_S = 10, 4, 20  # than simulated time, between these lengths
_LAST_MS = 2500  # for which the end is shown
_ENDINGS = {".gif": "GIF", ".apng": "PNG", ".png": "PNG"}


def write_animation(recording: Recording, path: Path, done: Callable[[int, int], object]) -> int:
    """Write the animation of ``recording`` into ``path``, a GIF or an APNG by its ending: ten times
    as fast as simulated time, within 4 to 20 s. ``done(pictures, of)`` is called as it goes on.

    Returns the number of pictures. Raises ``InputError`` for another ending, a damaged run, and a
    file that cannot be written.
    """
    kind = _ENDINGS.get(path.suffix.lower())
    if kind is None:
        raise InputError(f"--animation: {path} does not end like an animation; allowed: "
                         f"{', '.join(_ENDINGS)}")
    instants = instants_of(recording.end_ns, len(recording.poses.times_ns))
    with target(path, "--animation") as beside:
        scene, pictures = AnimationScene(recording), []
        palette = Image.new("P", (1, 1))
        palette.putpalette(scene.palette())  # one for all: what stands still then costs nothing
        for number, time_ns in enumerate(instants, 1):
            pictures.append(scene.picture(time_ns).quantize(palette=palette,
                                                            dither=Image.Dither.NONE))
            done(number, len(instants))
        durations_ms = [1000 // _PICTURES_PER_S] * (len(instants) - 1) + [_LAST_MS]
        pictures[0].save(beside, kind, save_all=True, append_images=pictures[1:],
                         duration=durations_ms, loop=0, disposal=1 if kind == "GIF" else 0)
    return len(instants)


def instants_of(end_ns: int, poses: int) -> list[int]:
    """The simulated instants of the pictures, from 0 to ``end_ns``: no more than there are
    ``poses``."""
    seconds = min(max(end_ns / NS_PER_S / _FASTER, _SHORTEST_S), _LONGEST_S)
    count = min(round(seconds * _PICTURES_PER_S), poses) if end_ns else 1
    return np.linspace(0, end_ns, count).astype(np.int64).tolist() if count > 1 else [end_ns]
