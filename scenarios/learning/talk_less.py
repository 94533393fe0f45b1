"""Six robots learn how seldom they need to share their maps: the cross-entropy method, in NumPy.

    python scenarios/learning/talk_less.py train      (each of five learners: 2 minutes of one core)
    python scenarios/learning/talk_less.py figure docs/pictures/talk_less.png
    python scenarios/learning/talk_less.py table

Goals are the scenario's strategy's affair. An agent shares its map when that shows ``threshold`` m2
more than when it last did; all agents learn one threshold. ``train`` writes training.csv and
evaluation.csv beside this file, which the others read: episodes of the evaluation have seeds that
no learner has met.
"""

import argparse
import csv
import time
from pathlib import Path

import numpy as np

from desim.engine.streams import Streams

HERE = Path(__file__).resolve().parent
STEP_NS, HORIZON_NS = 2 * 10**9, 60 * 10**9
PRICE = 0.0015  # m2 a byte: 1 kB is worth 1.5 m2
DISCOUNT = 0.95  # a step: what is known earlier is worth more
LEARNERS, GENERATIONS, CANDIDATES, ELITE, EPISODES = 5, 10, 10, 3, 3
EVALUATION = range(1000, 1020)  # seeds
BEGIN = 0.0, 2.0  # mean and spread of ln(threshold / m2): 1 m2, which is to share always
LEAST_SPREAD, SMOOTHING = 0.2, 0.8


def environment():
    from desim.envs import FrontierChoices, parallel_env

    return parallel_env(HERE / "talk_less.yaml", FrontierChoices(STEP_NS, 1), horizon_ns=HORIZON_NS,
                        price_per_byte=PRICE)


def played(env, seed, threshold_m2):
    """The discounted reward of the team in one episode, its length (s), the kB sent."""
    observed, _ = env.reset(seed=seed)
    value, weight, sent = 0.0, 1.0, 0
    while env.agents:
        observed, rewards, _, _, infos = env.step({
            name: {"goal": 0, "talk": int(own["news_m2"][0] >= threshold_m2)}
            for name, own in observed.items()})
        value += weight * sum(rewards.values())
        weight *= DISCOUNT
        sent += sum(info["bytes_sent"] for info in infos.values())
    return value, max(float(own["time_s"][0]) for own in observed.values()), sent / 1000


def learned(env, learner, generations=GENERATIONS, candidates=CANDIDATES, episodes=EPISODES):
    """A row each generation: the mean threshold after it, and the means of its candidates."""
    stream = Streams(learner)("talk less")
    mean, spread = BEGIN
    for generation in range(generations):
        drawn = mean + spread * stream.standard_normal(candidates)
        seeds = stream.integers(1000, size=episodes).tolist()  # the same for all candidates
        results = np.array([[played(env, seed, np.exp(one)) for seed in seeds] for one in drawn])
        best = drawn[np.argsort(-results[:, :, 0].mean(axis=1))[:ELITE]]
        mean += SMOOTHING * (best.mean() - mean)
        spread = max(LEAST_SPREAD, spread + SMOOTHING * (best.std() - spread))
        reward, seconds, kilobytes = results.mean(axis=(0, 1)).tolist()
        yield {"learner": learner, "generation": generation, "reward": reward, "time_s": seconds,
               "kB": kilobytes, "threshold_m2": float(np.exp(mean))}


def train():
    env, rows, evaluated = environment(), [], []
    thresholds = {"always": 0.0, "never": np.inf}
    for learner in range(LEARNERS):
        begin_s = time.process_time()
        for row in learned(env, learner):
            rows.append(row)
            print({key: round(value, 1) for key, value in row.items()}, flush=True)
        print(f"learner {learner}: {time.process_time() - begin_s:.0f} s of CPU", flush=True)
        thresholds[f"learner {learner}"] = rows[-1]["threshold_m2"]
    for policy, threshold_m2 in thresholds.items():
        for seed in EVALUATION:
            reward, seconds, kilobytes = played(env, seed, threshold_m2)
            evaluated.append({"policy": policy, "seed": seed, "reward": reward, "time_s": seconds,
                              "kB": kilobytes})
    write("training.csv", rows)
    write("evaluation.csv", evaluated)


def write(name, rows):
    with (HERE / name).open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, rows[0], lineterminator="\n")
        writer.writeheader()
        writer.writerows([{key: round(value, 3) if isinstance(value, float) else value
                           for key, value in row.items()} for row in rows])


def read(name):
    with (HERE / name).open(newline="", encoding="utf-8") as file:
        return [{key: value if key == "policy" else float(value) for key, value in row.items()}
                for row in csv.DictReader(file)]


def evaluation():
    """By policy [episodes, 3]: rewards, times (s), kB."""
    by_policy = {}
    for row in read("evaluation.csv"):
        by_policy.setdefault(row["policy"], []).append([row["reward"], row["time_s"], row["kB"]])
    return {policy: np.array(rows) for policy, rows in by_policy.items()}


def table():
    print("| policy | exploration time (s) | sent (kB) | reward |\n|---|---|---|---|")
    for policy, results in evaluation().items():
        reward, seconds, kilobytes = (f"{mean:.{digits}f} ± {spread:.{digits}f}" for mean, spread,
                                      digits in zip(results.mean(axis=0), results.std(axis=0),
                                                    (0, 1, 0), strict=True))
        print(f"| {policy} | {seconds} | {kilobytes} | {reward} |")


def figure(to):
    from matplotlib.figure import Figure

    rows = read("training.csv")
    shape = LEARNERS, len(rows) // LEARNERS
    fig = Figure(figsize=(8, 3), layout="constrained")
    for axes, (key, label) in zip(fig.subplots(1, 2), (
            ("kB", "sent in an episode (kB)"), ("time_s", "exploration time (s)")), strict=True):
        curves = np.array([row[key] for row in rows]).reshape(shape)
        x = np.arange(1, shape[1] + 1)
        axes.plot(x, curves.T, color="C0", alpha=0.3, linewidth=1)
        axes.plot(x, curves.mean(axis=0), color="C0", linewidth=2, label="five learners, mean")
        column = 2 if key == "kB" else 1
        for policy, colour in (("always", "C1"), ("never", "C2")):
            axes.axhline(evaluation()[policy][:, column].mean(), color=colour, linestyle="--",
                         label=f"{policy} talk")
        axes.set(xlabel="generation of 30 episodes", ylabel=label, ylim=(0, None), xticks=x)
    axes.legend(fontsize="small", loc="lower right")
    fig.savefig(to, dpi=110)


def main():
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    commands = parser.add_subparsers(required=True)
    for command in (train, table):
        commands.add_parser(command.__name__).set_defaults(command=lambda own, do=command: do())
    drawn = commands.add_parser("figure")
    drawn.add_argument("to")
    drawn.set_defaults(command=lambda own: figure(own.to))
    own = parser.parse_args()
    own.command(own)


if __name__ == "__main__":
    main()
