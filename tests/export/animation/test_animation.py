"""``desim export --animation``: an animation whose pictures show robots where they were."""

from __future__ import annotations

import numpy as np
import pytest
from PIL import Image
from recorded import made, quiet

from desim import colours
from desim.api import recording_of
from desim.errors import InputError
from desim.export.animation.animation_file import instants_of, write_animation
from desim.export.animation.scene import AnimationScene
from desim.units import NS_PER_S


@pytest.fixture(scope="module")
def recording(repository, tmp_path_factory):
    return recording_of(made(repository, tmp_path_factory.mktemp("results")))


@pytest.fixture(scope="module", params=[".gif", ".apng", ".png"])
def animation(request, recording, tmp_path_factory):
    path = tmp_path_factory.mktemp("animation") / f"run{request.param}"
    assert write_animation(recording, path, quiet) == len(instants(recording))
    with Image.open(path) as image:
        pictures, durations_ms = [], []
        for number in range(image.n_frames):
            image.seek(number)
            durations_ms.append(image.info["duration"])
            pictures.append(np.asarray(image.convert("RGB")).astype(int))
        return pictures, durations_ms, image.info["loop"]


def instants(recording) -> list[int]:
    return instants_of(recording.end_ns, len(recording.poses.times_ns))


def robots_are_at(recording, picture: np.ndarray, time_ns: int) -> bool:
    """Whether each robot's colour is found within its own radius of its place, and nowhere where
    the terrain is unknown."""
    height, width = picture.shape[:2]
    places = recording.poses.at(time_ns)[:, :2]
    walls = np.array([(wall.x1_mm, wall.y1_mm, wall.x2_mm, wall.y2_mm)
                      for wall in recording.walls]).reshape(-1, 2) / 1000
    low, high = walls.min(0), walls.max(0)
    scale = 580 / (high - low).max()
    for number, (x_m, y_m) in enumerate(places):
        x, y = 10 + (x_m - low[0]) * scale, 10 + (high[1] - y_m) * scale
        colour = 255 * np.array(colours.of_robot(number))
        part = picture[max(0, int(y) - 6):int(y) + 7, max(0, int(x) - 6):int(x) + 7]
        near = np.abs(part - colour).max(axis=-1) <= 2
        if near.mean() < 0.25:
            return False
    return (height, width) == (644, 600)


def test_each_robot_is_where_it_was(recording, animation):
    pictures, _, _ = animation
    times_ns = instants(recording)
    for number in (0, 20, len(times_ns) - 1):
        assert robots_are_at(recording, pictures[number], times_ns[number])
    assert not robots_are_at(recording, pictures[0], recording.end_ns)


def test_it_lasts_a_tenth_of_the_run_and_repeats(recording, animation):
    pictures, durations_ms, loop = animation
    assert loop == 0 and sum(durations_ms[:-1]) == pytest.approx(
        max(recording.end_ns / NS_PER_S / 10, 4) * 1000, abs=200)
    assert durations_ms[-1] == 2500


def test_what_is_explored_grows(recording):
    scene = AnimationScene(recording)
    unknown = [(np.asarray(scene.picture(time_ns)) == (213, 218, 225)).all(axis=-1).sum()
               for time_ns in (0, recording.end_ns // 4, recording.end_ns)]
    assert unknown[0] > unknown[1] > unknown[2]


@pytest.mark.parametrize("end_s, poses, pictures", [
    (0, 1, 1), (1, 11, 11), (30, 301, 40), (112, 1121, 112), (5000, 50_000, 200)])
def test_pictures_cover_the_run(end_s, poses, pictures):
    times_ns = instants_of(end_s * NS_PER_S, poses)
    assert (len(times_ns), times_ns[-1]) == (pictures, end_s * NS_PER_S)


def test_another_ending_is_refused(recording, tmp_path):
    with pytest.raises(InputError) as error:
        write_animation(recording, tmp_path / "a.mp4", quiet)
    assert str(error.value) == (
        f"--animation: {tmp_path / 'a.mp4'} does not end like an animation; "
        "allowed: .gif, .apng, .png")
