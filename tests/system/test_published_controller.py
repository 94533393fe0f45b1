"""The scenario of the paper's controller."""

import numpy as np
from runs import SCENARIOS, built

FEW = ["fleet.size=4", "robot.localization=ground_truth"]


def driven(acks):
    simulation = built(SCENARIOS / "paper" / "published.yaml", *FEW, f"middleware.tcp.acks={acks}")
    outcome = simulation.run(until_ns=25 * 10**9)
    return [track.poses for track in simulation.monitor.tracks], outcome.digest


def test_implied_acknowledgements_change_no_robot_of_it():
    implied, one = driven("implied")
    sent, other = driven("sent")
    assert np.array_equal(implied, sent)
    assert np.ptp(implied, axis=0).max() > 10.0  # they drive
    assert one != other  # the network's rows differ
