"""Queues in front of one line: the textbook's M/D/1 and M/D/1/K, and ns-3's bottleneck."""

from __future__ import annotations

from collections.abc import Iterator

from desim.ports.cases import Check, Play, Setup
from netmodels.cases.load import Bottleneck
from netmodels.validation.tolerance import within

SERVICE_MS = 1.2016  # 1502 B at 10 Mb/s

# Packets that wait, load: share lost, of M/D/1/K with K one more (exact; Markov chain embedded at
# departures); and packets to send, so many that chance makes about 1 % of it.
FINITE = {(5, 1.2): (.18767, 200_000), (5, 0.9): (.04720, 500_000), (5, 0.7): (.00834, 1_200_000),
          (10, 1.2): (.16956, 200_000), (10, 0.9): (.01315, 2_500_000)}

# Senders, load: share lost, and mean delay in ms of a full queue of 100 packets at 10 Mb/s.
PERIODIC = {
    (1, 1.05): (.0478, 121.83), (1, 1.2): (.1668, 121.77), (1, 2.0): (.5000, 121.77),
    (10, 1.05): (.0476, 120.50), (10, 1.2): (.1667, 120.97), (10, 2.0): (.5000, 121.88),
    (30, 1.05): (.0477, 119.89), (30, 1.2): (.1669, 121.02), (30, 2.0): (.5001, 121.81),
}

_STUDENT_99 = 2.861  # two-sided, 19 degrees of freedom: of 20 batches


# Load: packets, so many that chance makes less than 1 % of the wait (at 0.9: than 2 %).
WAITING = {0.3: 200_000, 0.5: 400_000, 0.8: 2_000_000, 0.9: 1_500_000}


class WaitingTimes:
    """Waiting time of M/D/1, its mean within 2 % up to a load of 0.8, at 0.9 within the 99 %
    interval."""

    source = "Pollaczek-Khinchine: load D / (2 (1 - load)), D = 1.2016 ms"

    def checks(self, play: Play) -> Iterator[Check]:
        for load, packets in WAITING.items():
            found = play(_bottleneck(load=load, senders=1, queue=None, latency="0 s",
                                     duration=_lasting(packets, load)))
            waited_ms = found["delay_mean_ms"] - SERVICE_MS
            expected_ms = load * SERVICE_MS / (2 * (1 - load))
            if load < 0.9:
                yield within(0.02, f"M/D/1, load {load}: wait", waited_ms, expected_ms, "ms")
            else:
                yield Check(f"M/D/1, load {load}: wait", waited_ms, expected_ms,
                            _STUDENT_99 * found["delay_error_ms"], "ms")


class FiniteQueue:
    """Loss of M/D/1/K: within 3 % of the exact one."""

    source = "M/D/1/K, exact"

    def checks(self, play: Play) -> Iterator[Check]:
        for (queue, load), (lost, packets) in FINITE.items():
            found = play(_bottleneck(load=load, senders=1, queue=queue,
                                     duration=_lasting(packets, load)))
            yield within(0.03, f"M/D/1/{queue + 1}, load {load}: loss", found["loss"], lost)


class PeriodicSenders:
    """Periodic senders at a bottleneck, as in ns-3: loss within 0.001, delay within 1 %."""

    source = "ns-3.44, DropTailQueue of 100 packets, 1502 B, 10 Mb/s, 1 ms"

    def checks(self, play: Play) -> Iterator[Check]:
        for (senders, load), (lost, delay_ms) in PERIODIC.items():
            found = play(_bottleneck(load=load, senders=senders, arrivals="periodic"))
            what = f"{senders} periodic senders, load {load}"
            yield Check(f"{what}: loss", found["loss"], lost, 0.001)
            yield within(0.01, f"{what}: delay", found["delay_mean_ms"], delay_ms, "ms")


def _bottleneck(**params: object) -> Setup:
    return Bottleneck(Bottleneck.Params(**params)).setup()


def _lasting(packets: int, load: float) -> str:
    """The time in which ``packets`` packets arrive."""
    return f"{packets * SERVICE_MS / load:.0f} ms"
