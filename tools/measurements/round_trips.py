"""The round trips of ``cellular`` beside those that were measured over 4G, by their quantiles.

    python tools/measurements/round_trips.py [--to FILE]

Prints the quantiles in ms, and draws them with --to. Measured are 741 735 round trips of 1024 B in
24.4 h, one after another (doi 10.5281/zenodo.14967644, experiment 003). The model's are of a frame
from a modem to a wired host every 120 ms for 24 h, without those that are sent before the last one
is back, and of the constant way back of a small frame.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from desim.testing import Bench
from netmodels.cellular import Cellular

MEASURED_MS = {0.01: 97, 0.1: 111, 0.5: 119, 0.9: 123, 0.99: 157, 0.999: 185}
FRAMES, EVERY_NS, FRAME_BYTES = 720_000, 120_000_000, 1066
BACK_MS = 37.0 + 7.5  # of a small frame, from a wired host to a modem


def round_trips_ms() -> np.ndarray:
    """Of the model, one after another."""
    bench = Bench(Cellular(Cellular.Params(wired=("host_2",))), 2)
    for k in range(FRAMES):
        bench.send(k * EVERY_NS, "host_1", "host_2", FRAME_BYTES, label=k * EVERY_NS)
    found_ms, back_ms = [], 0.0
    for time_ns, sent_ns, *_ in bench.run(10**20):
        if sent_ns / 1e6 >= back_ms:
            back_ms = time_ns / 1e6 + BACK_MS
            found_ms.append(back_ms - sent_ns / 1e6)
    return np.array(found_ms)


def draw(found_ms: np.ndarray, to: Path) -> None:
    """The shares of round trips that take longer, of the model as a line, measured as points."""
    figure = Figure(figsize=(6, 3.4), layout="constrained")
    axes = figure.subplots()
    longer = 1 - np.arange(len(found_ms)) / len(found_ms)
    axes.plot(np.sort(found_ms), longer, label="cellular")
    axes.plot(list(MEASURED_MS.values()), [1 - share for share in MEASURED_MS], "o", color="black",
              label="measured, 4G")
    axes.set(xscale="log", yscale="log", xlim=(90, 1000), ylim=(1e-4, 1.2),
             xlabel="round trip (ms)", ylabel="share that takes longer")
    axes.set_xticks([100, 200, 500, 1000], ["100", "200", "500", "1000"])
    axes.minorticks_off()
    axes.legend()
    figure.savefig(to, dpi=110)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--to", type=Path, help="a PNG")
    to = parser.parse_args().to
    found_ms = round_trips_ms()
    for share, measured_ms in MEASURED_MS.items():
        print(f"{100 * share:4g} %  {measured_ms} ms measured, {np.quantile(found_ms, share):.0f}")
    if to is not None:
        draw(found_ms, to)


if __name__ == "__main__":
    main()
