"""The bounds of checks that no publication gives: they follow from the protocols' own numbers."""

import numpy as np
import pytest

from netmodels.multihop.batman import HEADER_BYTES, BatmanConstants
from netmodels.validation.chain import repaired
from netmodels.validation.rules import FlappingAvailability


def checks(deserted_mbps, messages):
    """Both checks of a chain that carried 1 Mb/s for 10 s before its host left."""
    frames = 3
    size_bytes = frames * HEADER_BYTES + messages * BatmanConstants().message_bytes

    def play(setup, seed):
        goodput_mbps = deserted_mbps if played else 1.0
        played.append(setup)
        return {"measured_s": 10.0, "goodput_mbps": goodput_mbps, "control_frames": frames,
                "control_bytes": size_bytes}

    played = []
    return list(repaired(play, "ideal", 1))


@pytest.mark.parametrize(("deserted_mbps", "holds"), [
    (0.91, False), (0.89, True), (0.51, True), (0.49, False)])
def test_a_route_is_repaired_after_one_to_five_intervals_of_a_second(deserted_mbps, holds):
    assert checks(deserted_mbps, 100)[0].holds is holds


@pytest.mark.parametrize(("messages", "holds"), [
    (58, False), (59, True), (367, True), (368, False)])
def test_each_of_six_hosts_sends_its_messages_and_may_pass_on_those_of_others(messages, holds):
    """At least 6 messages each 1.02 s, at most 36 each 0.98 s: 58.8 to 367.3 in 10 s."""
    assert checks(0.7, messages)[1].holds is holds


def test_the_error_of_an_availability_is_that_of_a_chain_of_two_states():
    """40,000 samples, 5 s apart: their variance and all their covariances, from the rates alone."""
    rates = np.array([[-1 / 40, 1 / 40], [1 / 10, -1 / 10]])  # up and down
    step = np.linalg.matrix_power(np.eye(2) + rates * 5 / 2 ** 20, 2 ** 20)
    both_up = [np.linalg.matrix_power(step, samples)[0, 0] for samples in range(200)]
    covariances = [0.8 * (chance - 0.8) for chance in both_up]
    error = np.sqrt((covariances[0] + 2 * sum(covariances[1:])) / 40_000)
    check, = FlappingAvailability().checks(lambda setup: {"loss": 0.2})
    assert check.tolerance == pytest.approx(3.3 * error, rel=1e-3)
