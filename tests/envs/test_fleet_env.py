"""A fleet as PettingZoo's environment: its own tests, knowledge, airtime, rewards, episodes."""

import importlib
import sys
import warnings

import numpy as np
import pytest
from runs import HELLO, HERE

from desim.errors import InputError
from desim.units import NS_PER_S

pytest.importorskip("pettingzoo", reason="PettingZoo is not installed (pip install 'desim[envs]')")

from gymnasium.utils.env_checker import data_equivalence  # noqa: E402
from pettingzoo.test import parallel_api_test, parallel_seed_test  # noqa: E402

from desim.envs import FleetEnv, FrontierChoices, Velocities, parallel_env  # noqa: E402

SHORT_NS = 8 * NS_PER_S
CONTROLS = {"frontiers": FrontierChoices, "velocities": Velocities}
FIELD = ["deployment=field"]


def episode(env, action, seed=1, watch=lambda observed: None):
    """All rewards and infos of an episode in which every agent does the same."""
    observed, _ = env.reset(seed=seed)
    kept = []
    while env.agents:
        watch(observed)
        observed, rewards, _, _, infos = env.step({
            name: action(observed[name]) for name in env.agents})
        kept.append((rewards, infos))
    return kept


def bytes_sent(kept):
    return sum(info["bytes_sent"] for _, infos in kept for info in infos.values())


def silent(observed):
    return {"goal": 0, "talk": 0}


def speaking(observed):
    return {"goal": 0, "talk": 1}


@pytest.mark.parametrize("control", CONTROLS.values(), ids=CONTROLS)
def test_the_api_of_pettingzoo(control, capsys):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        parallel_api_test(parallel_env(HELLO, control(), horizon_ns=SHORT_NS), num_cycles=30)


@pytest.mark.parametrize("control", CONTROLS.values(), ids=CONTROLS)
def test_equal_seeds_give_equal_episodes(control):
    parallel_seed_test(lambda: parallel_env(HELLO, control(), horizon_ns=SHORT_NS), num_cycles=10)


def test_without_a_seed_episodes_differ_and_repeat():
    def three():
        env = parallel_env(HELLO, overrides=[*FIELD, "robot.laser.noise=2 cm"],
                           horizon_ns=3 * NS_PER_S)
        found = []
        for _ in range(3):
            observed, _ = env.reset()
            while env.agents:
                observed, *_ = env.step({name: silent(None) for name in env.agents})
            found.append(observed["robot_0"]["known_m2"].item())
        return found

    first = three()
    assert len(set(first)) == 3
    assert three() == first


@pytest.mark.parametrize("control", CONTROLS.values(), ids=CONTROLS)
def test_observations_are_in_their_spaces(control):
    env = parallel_env(HELLO, control(), horizon_ns=SHORT_NS)

    def check(observed):
        for name, own in observed.items():
            assert env.observation_space(name).contains(own), name

    for agent in env.possible_agents:
        env.action_space(agent).seed(1)
    episode(env, lambda own: env.action_space("robot_0").sample(), watch=check)


def test_who_does_not_speak_sends_nothing_and_hears_nothing():
    heard = []
    env = parallel_env(HELLO, overrides=FIELD)
    kept = episode(env, silent, watch=lambda observed: heard.append(
        max(own["peers"].max() for own in observed.values())))
    assert bytes_sent(kept) == 0 and max(heard) == 0


def seen(world, env, control, action):
    """All that agents observe in an episode in a world of ``puppets``."""
    observed = []
    episode(env(HELLO, control, horizon_ns=SHORT_NS, overrides=[
        f"physics.model=puppets:{world}", "robot.localization=odometry", "stop.explored=100 %",
        "stop.by=all"]), lambda _: action, watch=observed.append)
    return observed


@pytest.fixture
def no_readings(monkeypatch):
    monkeypatch.syspath_prepend(str(HERE / "system"))
    importlib.import_module("puppets").READ.clear()


STEERED = {"velocity": np.array([0.4, 0.3], np.float32), "talk": 1}


@pytest.mark.parametrize(("control", "action"), [
    (FrontierChoices(), {"goal": 1, "talk": 1}), (Velocities(), STEERED)], ids=CONTROLS)
def test_agents_observe_no_truth(control, action, no_readings):
    """In a world in which only their sensors' readings are true they observe the same."""
    with_truth = seen("Recorded", parallel_env, control, action)
    assert with_truth[-1]["robot_0"]["pose"].any()
    assert data_equivalence(with_truth, seen("Scrambled", parallel_env, control, action))


class SeesTheTruth(FleetEnv):
    """A twin: agents observe where their robots truly are."""

    def _observe(self, name):
        own, world = super()._observe(name), self._run.simulation.world
        pose = world.snapshot().poses[world.robots.index(name)]
        return {**own, "pose": pose.astype(np.float32)}


def test_an_agent_that_observes_the_truth_is_found(no_readings):
    with_truth = seen("Recorded", SeesTheTruth, Velocities(), STEERED)
    assert not data_equivalence(with_truth, seen("Scrambled", SeesTheTruth, Velocities(), STEERED))


def test_messages_cost_airtime():
    """Over a radio that carries next to nothing less arrives, and later."""
    def ages(*overrides):
        found = []
        episode(parallel_env(HELLO, overrides=[*FIELD, *overrides], horizon_ns=10 * NS_PER_S),
                speaking, watch=lambda observed: found.append(
                    sum(own["peers"][:, 0].sum() for own in observed.values())))
        return found

    wide = ages("network.media.air={model: radio}")
    narrow = ages("network.media.air={model: radio}", "network.media.air.rules=[{rule: bandwidth, "
                  "rate: 1 kb/s, burst: 1 kB}]")
    assert sum(narrow) < sum(wide)
    assert wide[-1] == 6


def test_agents_speak_at_phases_of_their_own():
    """All that is said in one instant meets on the air; steps make no such instant."""
    env = parallel_env(HELLO, overrides=FIELD, horizon_ns=6 * NS_PER_S)
    env.reset(seed=1)
    sent, graph = [], env._run.simulation.graph
    depart = graph.depart
    graph.depart = lambda message, receivers: (sent.append((message.born_ns, message.origin.name)),
                                               depart(message, receivers))
    while env.agents:
        env.step({name: speaking(None) for name in env.agents})
    times = [time_ns for time_ns, _ in sent]
    assert len(times) > 5 and len(set(times)) == len(times)
    assert {name for _, name in sent} == set(env.possible_agents)


def test_rewards_are_areas_less_the_price_of_bytes():
    free = episode(parallel_env(HELLO, overrides=FIELD, per_m2=2.0), speaking)
    dear = episode(parallel_env(HELLO, overrides=FIELD, per_m2=2.0, price_per_byte=0.01), speaking)
    assert bytes_sent(free) == bytes_sent(dear) > 10_000
    for (with_it, _), (without, infos) in zip(dear, free, strict=True):
        for name, reward in with_it.items():
            assert reward == pytest.approx(without[name] - 0.01 * infos[name]["bytes_sent"])


def test_a_goal_is_taken_at_the_turn():
    env = parallel_env(HELLO, overrides=FIELD)
    observed, _ = env.reset(seed=1)
    observed, *_ = env.step({name: silent(None) for name in env.agents})
    frontiers = observed["robot_0"]["frontiers"]
    assert frontiers[1, 3] > 0
    for choice in (1, 2):
        observed, *_ = env.step({name: {"goal": choice, "talk": 0} for name in env.agents})
        has_goal, *place = observed["robot_0"]["goal"]
        distances = np.hypot(*(frontiers[frontiers[:, 3] > 0, :2] - place).T)
        assert has_goal == 1
        if choice == 1:  # it may have moved on within a step
            assert distances.min() < 3


def test_an_agent_steers():
    env = parallel_env(HELLO, Velocities(), overrides=FIELD, horizon_ns=4 * NS_PER_S)
    poses = []
    episode(env, lambda own: {"velocity": np.array([0.5, 0.0], np.float32), "talk": 0},
            watch=lambda observed: poses.append(observed["robot_0"]["pose"]))
    way_m = np.hypot(*(poses[-1] - poses[1])[:2])
    assert 1.0 < way_m < 2.0


@pytest.mark.parametrize(("options", "ends"), [
    ({"horizon_ns": 4 * NS_PER_S}, (False, True)),
    ({"overrides": ["stop.elapsed=5 s"]}, (False, True)),
    ({"overrides": ["stop.explored=20 %"]}, (True, False)),
])
def test_an_episode_ends(options, ends):
    env = parallel_env(HELLO, **options)
    env.reset(seed=1)
    while env.agents:
        _, _, terminated, truncated, _ = env.step({name: silent(None) for name in env.agents})
    assert [(terminated[name], truncated[name]) for name in env.possible_agents] == [ends] * 3


@pytest.mark.parametrize("exchange", ["null", "{model: submaps}"])
def test_robots_that_cannot_share_on_request_are_refused(exchange):
    with pytest.raises(InputError, match="coordination.exchange"):
        parallel_env(HELLO, overrides=[f"coordination.exchange={exchange}"])


def test_a_step_needs_an_episode():
    with pytest.raises(InputError, match="begins with reset"):
        parallel_env(HELLO).step({})


def test_without_pettingzoo_one_line_says_how_to_get_it(monkeypatch):
    for name in [name for name in sys.modules if name.startswith(("desim.envs", "pettingzoo"))]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, "pettingzoo", None)
    with pytest.raises(InputError) as caught:
        import desim.envs  # noqa: F401
    assert str(caught.value) == ("desim.envs: pettingzoo is not installed; "
                                 "pip install 'desim[envs]'")
