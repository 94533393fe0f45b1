"""Bodies of another simulator under desim's sensors, maps and networks: ``ports.Bodies``."""

import math
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest
from runs import HELLO, MAZE_8, built, finished

from desim.errors import InputError, ModelError

FOREIGN = Path(__file__).resolve().parents[2] / "scenarios" / "foreign"
SLIDERS = f"physics.model={__name__}:Sliders"
SECOND = "stop.elapsed=1 s"


class Sliders:
    """Bodies that have the velocity that was commanded at once, and go through everything."""

    def start(self, arena):
        self.arena, self.poses = arena, arena.poses.copy()
        self.velocities, self.travelled_m = 0.0 * arena.poses, np.zeros(len(arena.robots))

    def command(self, robot, velocity, now_ns):
        self.velocities[robot] = velocity

    def surround(self, walls, tops_m, discs):
        self.around = walls, tops_m, discs

    def advance(self, now_ns, dt_s):
        self.poses = self.ahead(round(dt_s * 1e9))
        self.travelled_m += np.abs(self.velocities[:, 0]) * dt_s
        return [(0, 2), (1, -1)] if 500_000_000 <= now_ns < 510_000_000 else []

    def ahead(self, after_ns):
        (speed, turn), yaw = self.velocities[:, ::2].T * (after_ns / 1e9), self.poses[:, 2]
        return self.poses + np.column_stack([speed * np.cos(yaw), speed * np.sin(yaw), turn])


class Flat(Sliders):
    def advance(self, *tick):
        began = super().advance(*tick)
        self.poses = self.poses[:, :2]
        return began


class Lost(Sliders):
    def ahead(self, after_ns):
        return super().ahead(after_ns) + math.nan


class Ghost(Sliders):
    def advance(self, *tick):
        super().advance(*tick)
        return [(0, 7)]


class Silent(Sliders):
    def advance(self, *tick):
        super().advance(*tick)


class Wordy(Sliders):
    def start(self, arena):
        super().start(arena)
        self.velocities = "fast"


class Deaf:
    def start(self, arena): ...
    def ahead(self, after_ns): ...


def test_bodies_get_the_fleet_and_the_walls_and_move_as_the_robots_say():
    simulation = built(HELLO, SLIDERS, SECOND)
    bodies = simulation.world._bodies._bodies
    arena = bodies.arena
    assert arena.robots == ("robot_0", "robot_1", "robot_2")
    assert arena.poses.tolist() == [[-10.0, 10.0, 0.0], [-8.0, 10.0, 0.0], [-6.0, 10.0, 0.0]]
    assert arena.tick_s == pytest.approx(1 / 60)
    assert [kind.radius_m for kind in arena.types] == [simulation.world.body(0).radius_m] * 3
    assert [len(each) for each in bodies.around] == [7, 7, 0]
    assert len(arena.obstacles.segments) == 7  # the drawing: four outside, three inside
    finished(simulation)
    assert bodies.travelled_m.max() > 0.1
    assert simulation.world.snapshot().poses.tolist() == bodies.poses.tolist()


def test_contacts_of_the_bodies_are_collisions_of_the_robots():
    simulation = built(HELLO, SLIDERS, SECOND)
    finished(simulation)
    incidents = simulation.monitor.incidents
    assert (incidents.collisions, incidents.collisions_of) == (2, [1, 1, 1])


@pytest.mark.parametrize("bodies, says", [
    (Flat, "poses must be finite numbers of shape [3, 3], got shape [3, 2]"),
    (Lost, "poses must be finite numbers of shape [3, 3], got nan"),
    (Ghost, "advance returned [(0, 7)]; wanted: a list of contacts (robot, other robot or -1)"),
    (Silent, "advance returned None; wanted: a list of contacts (robot, other robot or -1)"),
    (Wordy, "velocities must be numbers, got 'fast'"),
])
def test_a_wrong_answer_names_the_class_and_what_is_wanted(bodies, says):
    with pytest.raises(ModelError) as error:
        built(HELLO, f"physics.model={__name__}:{bodies.__name__}", SECOND).run()
    assert f"{__name__}.{bodies.__name__}" in str(error.value)
    assert says in str(error.value)


def test_bodies_without_all_methods_are_refused():
    with pytest.raises(InputError, match=(
            r"physics\.model: the world '\S+:Deaf' has no command\(\), surround\(\), advance\(\): "
            r"it is not a plug-in for this place; wanted: a class with all methods of "
            r"desim\.ports\.Bodies")):
        built(HELLO, f"physics.model={__name__}:Deaf")


def test_robots_that_follow_a_recording_have_desims_own_bodies():
    with pytest.raises(InputError, match=r"physics\.model: \S+ moves as a recording says, which "
                                         r"bodies of another simulator cannot; allowed: plane"):
        built(HELLO.parent / "follow.yaml", SLIDERS)


@pytest.mark.skipif(find_spec("mujoco") is None, reason="mujoco is not installed")
def test_mujocos_bodies_drive_the_same_way_twice():
    def run():
        simulation = built(MAZE_8, f"physics.model={FOREIGN}/mujoco_bodies:MuJoCoBodies",
                           "stop.elapsed=20 s")
        outcome = finished(simulation)
        return outcome.digest, simulation.world.travelled_m().sum()

    digest, travelled_m = run()
    assert run() == (digest, travelled_m)
    assert 50.0 < travelled_m < 8 * 20 * 1.2


def test_examples_are_short():
    for example in FOREIGN.glob("*.*"):
        assert len(example.read_text(encoding="utf-8").splitlines()) < 80, example
