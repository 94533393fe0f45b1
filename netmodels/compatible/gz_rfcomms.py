"""The radio that Gazebo and the SubT Challenge have in common.

Log-normal power, errors of QPSK, and a limit of bits per epoch (gz-sim, src/systems/rf_comms;
osrf/subt, subt_communication_model).
"""

from __future__ import annotations

from collections import deque
from typing import Literal

import numpy as np
from pydantic import Field
from scipy.special import erfc

from desim import ports
from desim.units import NS_PER_S, BitRate, Decibels, Duration, Length, Level, Period
from netmodels.itemized import Itemized
from netmodels.random_loss import PairStreams, drop

REASONS = ("channel_error", "out_of_range", "out_of_reach", "rate_limited", "receiver_limited")

Sigma = Literal["deviation", "variance"]

_NEAREST_M = 1e-9  # so that log10 of a distance of 0 is a number


class RfParams(ports.Params):
    """The parameters that both have."""

    range_m: Length = Field("50 m", gt=0, description="nothing gets farther, max_range (gz-sim)")
    exponent: float = Field(2.5, gt=0, le=20, description="of the distance, fading_exponent "
                                                          "(gz-sim)")
    reference_db: Decibels = Field("40 dB", description="loss of the first metre, l0 (gz-sim)")
    sigma_db: Decibels = Field("10 dB", description="of the received power, drawn anew for each "
                                                    "message (gz-sim)")
    sigma_is: Sigma = Field("deviation", description=(
        "what sigma is used as (gz-sim since pull request 1743; before, and in SubT, variance: 10 "
        "are a standard deviation of 3.16 dB)"))
    power_dbm: Level = Field("27 dBm", description="sent, tx_power (gz-sim)")
    noise_dbm: Level = Field("-90 dBm", description="noise_floor (gz-sim)")
    errors: Literal["bytes", "bits"] = Field("bytes", description=(
        "how often an error is possible: (1 - BER)^bytes, which is what both do, or (1 - BER)^bits "
        "(gz-sim)"))
    capacity_bps: BitRate = Field("54 Mb/s", description="of each sender and of each receiver "
                                                         "(gz-sim)")
    epoch_ns: Period = Field("1 s", description="over which the capacity is counted (gz-sim)")
    step_ns: Duration = Field("1 ms", description="of the simulator, after which a message is "
                                                  "there (Gazebo's physics)")


class CapacityWindow:
    """The bytes that a host has sent or received in the last epoch."""

    def __init__(self, capacity_bps: int, epoch_ns: int) -> None:
        self._most_bits, self._epoch_ns = capacity_bps * epoch_ns // NS_PER_S, epoch_ns
        self._past: deque[tuple[int, int]] = deque()
        self._bytes = 0

    def take(self, now_ns: int, size_bytes: int) -> bool:
        """Whether that much more is within the capacity; if so, it is counted."""
        past = self._past
        while past and past[0][0] < now_ns - self._epoch_ns:
            self._bytes -= past.popleft()[1]
        if 8 * (self._bytes + size_bytes) > self._most_bits:
            return False
        past.append((now_ns, size_bytes))
        self._bytes += size_bytes
        return True


class GzRfComms(Itemized):
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

    Capabilities: Itemizes, LimitsReach.
    """

    Params = RfParams
    reasons = REASONS
    _stream = "gz_rfcomms"  # of random numbers

    def __init__(self, params: RfParams) -> None:
        self._params = params
        self.reach_m = params.range_m

    def start(self, context: ports.Context, hosts: tuple[str, ...]) -> None:
        self._context = context
        params = self._params
        self._streams = PairStreams(context, self._stream, hosts)
        self._sent, self._received = (
            [CapacityWindow(params.capacity_bps, params.epoch_ns) for _ in hosts] for _ in range(2))

    def send(self, frame: ports.Frame) -> None:
        places = self._context.positions(self._context.now_ns)
        apart = places[list(frame.receivers)] - places[frame.source]
        self._settle(frame, np.hypot(*apart.T),
                     np.full(len(frame.receivers), self._params.exponent))

    def _settle(self, frame: ports.Frame, distances_m: np.ndarray, exponents: np.ndarray) -> None:
        """Settle ``frame``: ``distances_m`` and ``exponents`` [n] of its receivers, NaN where
        nothing gets. Messages arrive at the end of the step."""
        fates: dict[tuple[str | None, tuple[int, ...]], list[int]] = {}
        context, step_ns = self._context, self._params.step_ns
        now_ns = context.now_ns
        mean_dbm = received_dbm(self._params, distances_m, exponents).tolist()
        wait_ns = step_ns - now_ns % step_ns if step_ns else 0
        self._ledger.spent(frame, ports.TimePart.PROPAGATION, wait_ns)
        for receiver, dbm in zip(frame.receivers, mean_dbm, strict=True):
            reason, lost = self._fate(frame, receiver, dbm, now_ns)
            if reason == "out_of_range" and frame.broadcast:
                reason = "out_of_reach"
            fates.setdefault((reason, lost), []).append(receiver)
        for (reason, lost), receivers in fates.items():
            if reason:
                context.settle_many(frame, receivers, drop(reason, lost, frame.segments))
            if len(lost) < frame.segments:
                context.settle_many(frame, receivers, ports.Deliver(wait_ns))

    def _fate(self, frame: ports.Frame, receiver: int, mean_dbm: float, now_ns: int
              ) -> tuple[str | None, tuple[int, ...]]:
        """The reason of the loss, and the packets that are lost. A receiver out of range still
        counts as sent to. The power is drawn once for a train, and errors for each packet, so that
        all of it arrives with the chance of one message of all its bytes."""
        whole = tuple(range(frame.segments))
        stream = self._streams(frame.source, receiver)
        off, draws = stream.standard_normal(), stream.random(frame.segments)
        if not self._sent[frame.source].take(now_ns, frame.size_bytes):
            return "rate_limited", whole
        if mean_dbm != mean_dbm:  # NaN
            return "out_of_range", whole
        dbm = mean_dbm + deviation_db(self._params) * off
        sizes = np.array(ports.packet_sizes(frame.size_bytes, frame.segments))
        lost = tuple(np.flatnonzero(draws >= delivery(self._params, dbm, sizes)).tolist())
        left_bytes = frame.size_bytes - int(sizes[list(lost)].sum())
        if left_bytes and not self._received[receiver].take(now_ns, left_bytes):
            return "receiver_limited", whole
        return ("channel_error", lost) if lost else (None, ())


def received_dbm(params: RfParams, distances_m: np.ndarray, exponents: np.ndarray) -> np.ndarray:
    """power - (reference + 10 exponent log10(d / 1 m)), on the average; NaN beyond ``range``."""
    distances_m = np.where(distances_m <= params.range_m, distances_m, np.nan)
    return params.power_dbm - params.reference_db - 10 * exponents * np.log10(
        np.maximum(distances_m, _NEAREST_M))


def deviation_db(params: RfParams) -> float:
    """The standard deviation of the received power."""
    return params.sigma_db if params.sigma_is == "deviation" else params.sigma_db ** 0.5


def delivery(params: RfParams, power_dbm: np.ndarray | float, size_bytes: np.ndarray | int
             ) -> np.ndarray:
    """Chance of a message that comes in with ``power_dbm``: BER = erfc(sqrt(signal / noise)), and
    (1 - BER)^bytes, or with ``errors: bits`` (1 - BER)^(8 bytes)."""
    ratio = 10 ** ((power_dbm - params.noise_dbm) / 10)
    with np.errstate(divide="ignore"):  # where a bit is never right
        right = np.log1p(-erfc(np.sqrt(ratio)))
    return np.exp(size_bytes * (8 if params.errors == "bits" else 1) * right)
