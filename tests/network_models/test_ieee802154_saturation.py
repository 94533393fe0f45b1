"""Saturated senders of ``ieee802154`` against an independent simulation."""

import math

import numpy as np
import pytest

from desim.testing import Bench
from desim.units import NS_PER_S
from netmodels.ieee802154 import Ieee802154

FULL = 46 + 107  # the longest packet in one frame, 127 B
FATES = ("arrived", "channel_busy", "retry_limit")
SECONDS = 40


class Station:
    """One sender of the reference below: what it does, and for how many steps of 32 us more."""

    def __init__(self, draws):
        self.draws, self.failed, self.received = draws, 0, False
        self.contend()

    def contend(self):
        self.exponent, self.busy = 3, 0
        self.back_off()

    def back_off(self):
        self.does, self.left = "waits", 10 * int(self.draws.integers(2 ** self.exponent))

    def next_packet(self):
        self.failed, self.received = 0, False
        self.does, self.left = "pauses", 20

    def lose(self, reason, fates):
        fates[reason] += not self.received
        self.next_packet()

    def step(self, fates):
        """Its time is over. Returns whether a frame has got through."""
        if self.does == "pauses":
            self.contend()
        elif self.does == "waits":
            self.does, self.left, self.heard = "listens", 4, False
        elif self.does == "listens" and not self.heard:
            self.does, self.left = "turns", 6
        elif self.does == "listens":
            self.busy, self.exponent = self.busy + 1, min(self.exponent + 1, 5)
            if self.busy <= 4:
                self.back_off()
            else:
                self.lose("channel_busy", fates)
        elif self.does == "turns":
            self.does, self.left, self.spoiled = "sends", 133, False
        elif self.does == "sends":
            self.does, self.left = "expects", 27
            fates["arrived"] += not (self.spoiled or self.received)
            self.received |= not self.spoiled
            return not self.spoiled
        else:
            self.failed += 1
            if self.failed <= 3:
                self.contend()
            else:
                self.lose("retry_limit", fates)
        return False


class Reply:
    """An acknowledgement: 6 steps of turnaround, then 11 on the air."""

    def __init__(self, to):
        self.to, self.left, self.does, self.spoiled = to, 6, "turns", False


def reference(senders, seconds):
    """An independent simulation: state by state, in steps of 32 us, of saturated senders of full
    frames to one receiver. Returns for each second how many packets met which fate."""
    stations = [Station(np.random.default_rng((5, k))) for k in range(senders)]
    now, replies, log = 0, [], []
    while now < seconds * 31_250:
        if now >= len(log) * 31_250:
            log.append(dict.fromkeys(FATES, 0))
        everybody = [*stations, *replies]
        span = min(one.left for one in everybody)
        on_air = [one for one in everybody if one.does == "sends"] if span else []
        for one in everybody:
            one.left -= span
            if one.does == "listens" and on_air:
                one.heard = True
            if one.does == "sends" and len(on_air) > 1:
                one.spoiled = True
        now += span
        for reply in [reply for reply in replies if not reply.left]:
            if reply.does == "turns":
                reply.does, reply.left = "sends", 11
            else:
                replies.remove(reply)
                if not reply.spoiled:
                    reply.to.next_packet()
        replies += [Reply(one) for one in stations if not one.left and one.step(log[-1])]
    return log


def model(senders, seconds):
    """The log of saturated senders to one receiver."""
    hosts = {f"host_{number}": (0.0, 0.0) for number in range(1, senders + 2)}
    bench = Bench(Ieee802154(Ieee802154.Params(queue=10_000)), hosts)
    each = (160 // senders + 60) * seconds
    for sender in range(senders):
        for _ in range(each):
            bench.send(0, f"host_{sender + 2}", "host_1", FULL)
    log = bench.run(seconds * NS_PER_S - 1)
    sent = [source for _, _, source, *_ in log]
    assert max(sent.count(source) for source in set(sent)) < each  # nobody had nothing left to send
    return log


def assert_as_the_reference(senders):
    ours = [dict.fromkeys(FATES, 0) for _ in range(SECONDS)]
    for time_ns, *_, fate in model(senders, SECONDS):
        ours[time_ns // NS_PER_S][fate] += 1
    theirs = reference(senders, SECONDS)
    for fate in FATES:
        one, other = (np.array([second[fate] for second in log]) for log in (ours, theirs))
        error = math.sqrt((one.var(ddof=1) + other.var(ddof=1)) / SECONDS)
        assert abs(one.mean() - other.mean()) <= 3 * error, (fate, one.mean(), other.mean(), error)


@pytest.mark.parametrize("senders", [1, 2, 5, 10])
def test_saturated_senders_do_as_an_independent_simulation_says(senders):
    """Packets a second that arrive, that find no channel, and that are given up: within 3 standard
    errors of the difference."""
    assert_as_the_reference(senders)


def test_a_twin_that_turns_around_faster_would_be_seen(monkeypatch):
    monkeypatch.setattr("netmodels.ieee802154.TURNAROUND_NS", 160_000)
    with pytest.raises(AssertionError):
        assert_as_the_reference(5)
