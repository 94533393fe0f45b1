"""A fleet as PettingZoo's ``ParallelEnv``: its messages cost airtime on the scenario's network."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from gymnasium import spaces
from pettingzoo import ParallelEnv

from desim import plugins
from desim.engine.streams import Streams
from desim.envs.control import Action, Control, Observation, numbers
from desim.envs.frontier_choices import FrontierChoices
from desim.errors import InputError
from desim.ports import StrategyContext
from desim.ports.sharing import SharesOnRequest
from desim.scenario.load import load
from desim.scenario.names import robot_names
from desim.scenario.recipients import carrying_software
from desim.scenario.robot_types import equipment_of
from desim.stepping import Stepper
from desim.stepping.decisions import Decision
from desim.units import NS_PER_S

_SEEDS = 2**31
_FRONTIERS = FrontierChoices()


class FleetEnv(ParallelEnv[str, Observation, Action]):
    """One agent for each robot that carries software. A step is one period of ``control``, in which
    each robot has its turn, at a phase of its own that is drawn by name: no two speak at one
    instant because of the step.

    An action is a mapping: that of ``control``, and ``talk``: 1 shares the robot's map with its
    team now (nobody shares it else). An agent observes what its robot has sensed and received:

    ``time_s`` [1]: its clock | ``pose`` [3]: m, m, rad, as it estimates it; zeros before the first
    | ``peers`` [others, 5]: 1 if it has heard of that robot, then x, y, yaw, and the age (s) of
    that | ``known_m2`` [1]: on its own map | ``news_m2`` [1]: more than when it last shared it |
    and what ``control`` adds.

    The reward is the newly known area times ``per_m2``, minus what its interfaces have sent times
    ``price_per_byte``. An episode terminates when the scenario's stop condition is met, and is
    truncated after ``horizon_ns``, at most ``stop.elapsed``. ``overrides`` as ``desim.load``.
    Raises ``InputError`` for a wrong scenario, and one whose robots cannot share on request.
    """

    def __init__(self, scenario: str | Path, control: Control = _FRONTIERS, *,
                 overrides: Sequence[str] = (), horizon_ns: int | None = None,
                 per_m2: float = 1.0, price_per_byte: float = 0.0) -> None:
        self.metadata = {"name": "desim_fleet_v0", "render_modes": []}
        self._control = control
        exchange = load(scenario, overrides).scenario.coordination.exchange
        if exchange is None or not issubclass(plugins.load("sharing", exchange.model),
                                              SharesOnRequest):
            raise InputError("coordination.exchange: agents share maps when they want to; only "
                             "own_maps can")
        self._scenario = load(scenario, [*overrides, "coordination.exchange.period=null"]).scenario
        self._horizon_ns = min(horizon_ns or self._scenario.stop.elapsed_ns,
                               self._scenario.stop.elapsed_ns)
        self._per_m2, self._price = per_m2, price_per_byte
        equipment = dict(zip(robot_names(self._scenario), equipment_of(self._scenario),
                             strict=True))
        self.possible_agents = list(carrying_software(self._scenario))
        self.agents: list[str] = []
        common = {"time_s": numbers(1), "pose": numbers(3), "known_m2": numbers(1),
                  "news_m2": numbers(1), "peers": numbers(len(self.possible_agents) - 1, 5)}
        self._observed_in = {name: spaces.Dict({**common, **control.observations(equipment[name])})
                             for name in self.possible_agents}
        self._acts_in = {name: spaces.Dict({**control.actions(), "talk": spaces.Discrete(2)})
                         for name in self.possible_agents}
        self._seed: int | None = None
        self._run: Stepper[Decision] | None = None

    def observation_space(self, agent: str) -> spaces.Space:
        """The space of what ``agent`` observes."""
        return self._observed_in[agent]

    def action_space(self, agent: str) -> spaces.Space:
        """The space of the actions of ``agent``."""
        return self._acts_in[agent]

    def reset(self, seed: int | None = None, options: dict[str, object] | None = None
              ) -> tuple[dict[str, Observation], dict[str, dict[str, int]]]:
        """Begin an episode. Without a ``seed`` the first one has the scenario's, and each later one
        a seed that the one before determines."""
        if seed is None:
            seed = (self._scenario.seed if self._seed is None
                    else Streams(self._seed).integer(_SEEDS, "env", "next episode"))
        self.close()
        self._seed, self.agents = seed, [*self.possible_agents]
        self._run = Stepper(self._scenario.model_copy(update={"seed": seed}), self._control.turns)
        self._sent = dict.fromkeys(self.agents, 0)  # bytes, so far
        self._known = dict.fromkeys(self.agents, 0.0)  # m2 at the last step
        self._shared = dict.fromkeys(self.agents, 0.0)  # m2 when the map was shared last
        self._observed = {name: self._observe(name) for name in self.agents}
        return dict(self._observed), {name: {} for name in self.agents}

    def step(self, actions: Mapping[str, Action]
             ) -> tuple[dict[str, Observation], dict[str, float], dict[str, bool], dict[str, bool],
                        dict[str, dict[str, int]]]:
        """Let each robot have its turn, and return observations, rewards, terminations, truncations
        and infos (``bytes_sent`` in this step)."""
        run, agents = self._running(), self.agents
        end_ns = min(run.now_ns + self._control.turns.period_ns, self._horizon_ns)
        while (turn := run.next_decision(end_ns)) is not None:
            if turn.robot in actions:
                self._act(turn.context, actions[turn.robot])
        self._observed = {name: self._observe(name) for name in agents}
        rewards, infos = {}, {}
        for name in agents:
            known_m2, sent = self._robot(name).known_m2(), self._bytes_sent(name)
            grown_m2, bytes_ = known_m2 - self._known[name], sent - self._sent[name]
            self._known[name], self._sent[name] = known_m2, sent
            rewards[name] = self._per_m2 * grown_m2 - self._price * bytes_
            infos[name] = {"bytes_sent": bytes_}
        terminated = run.simulation.monitor.stop_reason is not None
        truncated = not terminated and run.now_ns >= self._horizon_ns
        if terminated or truncated:
            self.agents = []
            run.close()
        return (dict(self._observed), rewards, dict.fromkeys(agents, terminated),
                dict.fromkeys(agents, truncated), infos)

    def close(self) -> None:
        """End the episode."""
        if self._run is not None:
            self._run.close()

    def _running(self) -> Stepper[Decision]:
        if self._run is None:
            raise InputError("an episode begins with reset()")
        return self._run

    def _robot(self, name: str) -> StrategyContext:
        return self._running().robots[name]

    def _bytes_sent(self, name: str) -> int:
        return self._running().simulation.graph.host(name).tx_bytes

    def _act(self, context: StrategyContext, action: Action) -> None:
        self._control.act(context, action, self._observed[context.name])
        if action["talk"]:
            self._shared[context.name] = context.known_m2()
            context.share_map()

    def _observe(self, name: str) -> Observation:
        context = self._robot(name)
        known_m2, now_ns = context.known_m2(), context.now_ns
        peers = np.zeros((len(self.possible_agents) - 1, 5), np.float32)
        others = [other for other in self.possible_agents if other != name]
        for row, other in zip(peers, others, strict=True):
            peer = context.peers.get(other)
            if peer is not None:
                row[:] = 1.0, *peer[:3], (now_ns - peer.heard_ns) / NS_PER_S
        own = {"time_s": _array(now_ns / NS_PER_S), "pose": _array(*(context.pose or (0, 0, 0))),
               "known_m2": _array(known_m2), "news_m2": _array(known_m2 - self._shared[name]),
               "peers": peers, **self._control.observe(context)}
        return {key: own[key] if key in own else np.zeros(space.shape, np.float32)
                for key, space in self._observed_in[name].items()}


def _array(*values: float) -> np.ndarray:
    return np.array(values, np.float32)
