"""Steps a second that ``desim.envs`` takes, with and without talk.

    python tools/measurements/env_steps.py

Prints a row for each scenario and control: steps a second of CPU time, the best of three episodes.
All robots talk at each step, or never; over 802.11, with maps as ``deployment: field`` sends them.
"""

import time
from pathlib import Path

import numpy as np

from desim.envs import FrontierChoices, Velocities, parallel_env

SCENARIOS = Path(__file__).resolve().parents[2] / "scenarios"
FIELD = ["deployment=field", "network={fidelity: mac, media: {air: {model: radio}}}",
         "stop.explored=100 %",
         "coordination.exchange={model: own_maps}"]
S = 10**9
# Robots, scenario, name of the control, control, length of an episode.
CASES = [(3, "hello", "choices, 2 s", FrontierChoices(2 * S), 30 * S),
         (3, "hello", "velocities, 0.2 s", Velocities(S // 5), 20 * S),
         (8, "maze_8", "choices, 2 s", FrontierChoices(2 * S), 40 * S),
         (8, "maze_8", "velocities, 0.2 s", Velocities(S // 5), 10 * S)]


def episode(env, talk):
    """Steps a second of CPU time."""
    stream = np.random.default_rng(0)
    observed, _ = env.reset(seed=1)
    begin_s, steps = time.process_time(), 0
    while env.agents:
        actions = {}
        for name in env.agents:
            ahead_m = observed[name]["scan"].min() - 0.5 if "scan" in observed[name] else 0.0
            velocity = np.array([np.clip(ahead_m, 0.0, 0.5), stream.uniform(-1, 1)], np.float32)
            actions[name] = {"goal": 0, "velocity": velocity, "talk": talk}
        observed, *_ = env.step(actions)
        steps += 1
    return steps / (time.process_time() - begin_s)


def main():
    print("| robots | scenario | control, step | silent | talking |\n|---|---|---|---|---|")
    for robots, scenario, name, control, horizon_ns in CASES:
        env = parallel_env(SCENARIOS / f"{scenario}.yaml", control, overrides=FIELD,
                           horizon_ns=horizon_ns)
        rates = [max(episode(env, talk) for _ in range(3)) for talk in (0, 1)]
        print(f"| {robots} | `{scenario}` | {name} | {rates[0]:.0f} | {rates[1]:.0f} |", flush=True)


if __name__ == "__main__":
    main()
