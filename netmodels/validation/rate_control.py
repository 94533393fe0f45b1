"""Rate control: one sender against the Markov chain of what it knows, several against ns-3."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from scipy.sparse import coo_array, eye_array
from scipy.sparse.linalg import spsolve

from desim.ports.cases import NOWHERE, Check, Flow, Play, Setup
from desim.units import NS_PER_S
from netmodels.cases.traffic import SAME_POWER, numbered
from netmodels.radio.dcf.radio import DcfRadio
from netmodels.radio.delivery import delivery
from netmodels.radio.standards import ACK_BYTES, A, Standard, psdu_bytes
from netmodels.validation.layouts import PAIRS, parsed
from netmodels.validation.rates_of_ns3 import RatesOfNs3
from netmodels.validation.tolerance import within

UP, DOWN, TIMER, TRIES = 10, 2, 15, 7
POWERS_DBM = (-78.0, -77.5, -73.5, -73.0, -72.0, -71.5, -70.5)  # where 36, 48 and 54 Mb/s end

# Saturated stations to Mb/s of payload (1000 B of UDP, one sink, every pair at -50 dBm), five runs
# of 10 s each, at three and five stations of 60 s; and the first of ``layouts.PAIRS``.
AMONG_OTHERS = {2: 24.859, 3: 18.609, 5: 5.552, 10: 4.247}
TEN_PAIRS_MBPS = 40.15

_SIZE_BYTES, _PAYLOAD_BYTES = 1518, 1472
_DURATION_NS = 20 * NS_PER_S


class ArfState(NamedTuple):
    """The state of a sender before an attempt, and the number of attempts at this packet."""

    rate: int
    acknowledged: int = 0
    failed: int = 0
    attempts: int = 0
    probing: bool = False
    tries: int = 0


class FallbackOfRates:
    """Automatic rate fallback of one saturated sender: goodput within 0.5 % of the stationary one
    of the Markov chain, with the closed form's packet errors. Of several, who take collisions for
    errors, with ns-3's counting: within 3 %. And ``RatesOfNs3``."""

    source = ("Kamerman and Monteban 1997, as a Markov chain; times of IEEE 802.11-2016; "
              "ns-3.44, ArfWifiManager, five seeds; AarfWifiManager, IdealWifiManager")

    def checks(self, play: Play) -> Iterator[Check]:
        yield from self._alone(play)
        for stations, goodput_mbps in AMONG_OTHERS.items():
            senders = numbered("sender", stations)
            found = play(_saturated(dict.fromkeys((*senders, "sink"), NOWHERE),
                                    dict.fromkeys(senders, "sink"), 61, path_loss=SAME_POWER))
            yield within(0.03, f"11a, {stations} stations: goodput", found["goodput_mbps"],
                         goodput_mbps, "Mb/s")
        places = parsed(PAIRS[0][3])
        hosts = numbered("host", len(places))
        found = play(_saturated(dict(zip(hosts, places, strict=True)),
                                dict(zip(hosts[::2], hosts[1::2], strict=True)), 11))
        yield within(0.03, "11a, ten pairs on 120 m: goodput", found["goodput_mbps"],
                     TEN_PAIRS_MBPS, "Mb/s")
        yield from RatesOfNs3().checks(play)

    def _alone(self, play: Play) -> Iterator[Check]:
        for power_dbm in POWERS_DBM:
            radio = DcfRadio.Params(
                standard="11a", rate="54 Mb/s", rate_control={}, retries=TRIES,
                path_loss={"model": "fixed", "total": f"{16.0206 - power_dbm} dB"})
            found = play(Setup(DcfRadio(radio), {"a": NOWHERE, "b": NOWHERE},
                               [Flow("a", ("b",), _SIZE_BYTES, _PAYLOAD_BYTES)], _DURATION_NS))
            wrong = 1 - np.array([float(delivery(power_dbm, A, rate, psdu_bytes(_SIZE_BYTES, 1),
                                                 radio.reception.for_stations()))
                                  for rate in range(len(A.rates))])
            yield within(0.005, f"11a, {power_dbm:g} dBm: goodput", found["goodput_mbps"],
                         stationary_mbps(A, wrong), "Mb/s")


def _saturated(places: dict[str, tuple[float, float]], to: dict[str, str], until_s: int,
               **params: object) -> Setup:
    """Saturated flows ``to`` receivers by sender, after a second for the rates to settle."""
    radio = DcfRadio.Params(preset="ns3_3_44", standard="11a", rate="6 Mb/s", rate_control={},
                         **params)
    return Setup(DcfRadio(radio), places, [Flow(sender, (receiver,), 1046, 1000)
                                        for sender, receiver in to.items()],
                 until_s * NS_PER_S, NS_PER_S)


def stationary_mbps(standard: Standard, wrong: np.ndarray) -> float:
    """Payload that arrives, with the chance ``wrong`` [rates] that a packet has errors."""
    states, moves = [ArfState(len(wrong) - 1)], []
    places = {states[0]: 0}
    for at, state in enumerate(states):  # it grows
        for after, chance in ((_after(state, True, len(wrong)), 1 - wrong[state.rate]),
                              (_after(state, False, len(wrong)), wrong[state.rate])):
            if after not in places:
                places[after] = len(states)
                states.append(after)
            moves.append((places[after], at, chance))
    share = _stationary(len(states), moves)
    right = np.array([1 - wrong[state.rate] for state in states])
    time_ns = np.array([right[k] * _attempt_ns(standard, state, True)
                        + (1 - right[k]) * _attempt_ns(standard, state, False)
                        for k, state in enumerate(states)])
    return 8e3 * _PAYLOAD_BYTES * float(share @ right) / float(share @ time_ns)


def _after(state: ArfState, acknowledged: bool, rates: int) -> ArfState:
    attempts = min(state.attempts + 1, TIMER)
    if acknowledged:
        in_a_row = min(state.acknowledged + 1, UP)
        if state.rate < rates - 1 and (in_a_row == UP or attempts == TIMER):
            return ArfState(state.rate + 1, probing=True)
        return ArfState(state.rate, in_a_row, attempts=attempts)
    tries = (state.tries + 1) % TRIES
    if state.probing or state.failed + 1 == DOWN:
        return ArfState(max(state.rate - 1, 0), tries=tries)
    return ArfState(state.rate, failed=state.failed + 1, attempts=attempts, tries=tries)


def _stationary(states: int, moves: list[tuple[int, int, float]]) -> np.ndarray:
    """[states] shares: the solution of P x = x of sum 1."""
    to, at, chance = zip(*moves, strict=True)
    flow = (coo_array((chance, (to, at)), (states, states)) - eye_array(states)).tolil()
    flow[0, :] = 1.0
    return spsolve(flow.tocsc(), np.eye(states, 1).ravel())


def _attempt_ns(standard: Standard, state: ArfState, acknowledged: bool) -> float:
    """Mean time of an attempt: DIFS, half of the window, the packet, and the acknowledgement or
    what is waited for it."""
    window = min((standard.cw_min + 1) * 2 ** state.tries - 1, standard.cw_max)
    reply = standard.reply_rate(state.rate)
    answer_ns = standard.sifs_ns + (standard.airtime_ns(ACK_BYTES, reply) if acknowledged else
                                    standard.slot_ns + standard.rates[reply].payload_ns)
    return (standard.difs_ns + window / 2 * standard.slot_ns
            + standard.airtime_ns(psdu_bytes(_SIZE_BYTES, 1), state.rate) + answer_ns)
