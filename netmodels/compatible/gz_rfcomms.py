"""Gazebo's radios."""

from __future__ import annotations

import numpy as np

from desim import ports
from netmodels.compatible.rf import REASONS, Rf, RfParams


class GzRfComms:
    """Gazebo's RFComms system (gz-sim, src/systems/rf_comms): a host within ``range`` gets a
    message with the chance of a power that is drawn for this message alone.

    power = sent - reference - 10 exponent log10(distance / 1 m) + normal(0, sigma),
    BER = erfc(sqrt(power / noise)), and the message arrives with (1 - BER)^bytes. That is Gazebo's,
    and too good: a message has eight times as many bits (``errors: bits``). The capacity counts
    bits: a sender's message that would make more than capacity * epoch of the last epoch is lost
    (``rate_limited``), and so it is at a receiver (``receiver_limited``). Sent bytes count for
    each receiver, arrived or not.

    A train has one power, and each of its packets errors of its own: all of it arrives with the
    chance of one message of all its bytes. Nobody waits, and nobody hinders anybody else. Left out:
    heights, Gazebo's own headers (the frame's count), and the power that a receiver reads. A host
    without a place, as a radio without a model, gets and sends nothing.

    Capabilities: LimitsReach.
    """

    Params = RfParams
    reasons = REASONS
    _stream = "gz_rfcomms"  # of random numbers

    def __init__(self, params: RfParams) -> None:
        self._params = params
        self.reach_m = params.range_m

    def start(self, context: ports.Context, hosts: tuple[str, ...]) -> None:
        self._context = context
        self._rf = Rf(self._params, context, self._stream, hosts)

    def send(self, frame: ports.Frame) -> None:
        places = self._context.positions(self._context.now_ns)
        apart = places[list(frame.receivers)] - places[frame.source]
        self._rf.send(frame, np.hypot(*apart.T),
                      np.full(len(frame.receivers), self._params.exponent))
