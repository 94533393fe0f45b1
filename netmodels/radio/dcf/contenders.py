"""The records of contenders for the air: stations, and what else sends by a station's radio."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from netmodels.radio.dcf.kernels import records
from netmodels.radio.dcf.kernels.records import BLOCK, NEVER, Dcf
from netmodels.radio.standards import Access


def contenders(first: int, keys: np.ndarray, access: Sequence[Access]) -> np.ndarray:
    """Records of stations, from number ``first`` on, with an ``access`` and a key each."""
    found = np.zeros(len(keys), records.STATION)
    for field in "air_due", "contention_due", "answer_due":
        found[field] = NEVER
    found["index"] = found["radio"] = found["holder"] = np.arange(first, first + len(keys))
    found["key"], found["receives_from"], found["next"] = keys, -1, -1
    for field, of_each in zip((
            "aifsn", "window", "least_bits", "largest", "txop_ns", "rank"), zip(*(
                (one.aifsn, one.cw_min, one.cw_min.bit_length(), one.cw_max, one.txop_ns, one.rank)
                for one in access), strict=True), strict=True):
        found[field] = of_each
    return found


def no_events(stations: int) -> np.ndarray:
    """``Dcf.due`` of so many stations without events."""
    return np.full(-(-stations // BLOCK) * (1 + BLOCK), NEVER)


def with_another(states: Sequence[Dcf], radio: int, access: Access, key: int) -> list[Dcf]:
    """The states with one contender more, which uses the radio of a station. What they have in
    common they still have."""
    shared = {name: _longer(getattr(states[0], name), 1)
              for name in ("touched", "frames") if len(getattr(states[0], name))}
    outcomes = _longer(states[0].outcomes, 4 + states[0].frames.shape[1])
    return [_with_another(state, radio, access, key)._replace(outcomes=outcomes, **shared)
            for state in states]


def _with_another(state: Dcf, radio: int, access: Access, key: int) -> Dcf:
    number, setup = len(state.stations), state.setup[0]
    stations = np.concatenate([state.stations, contenders(
        number, np.array([key], np.uint64), [access])])
    own, other = stations[radio], stations[number]
    for field in "first_link", "last_link", "busy", "nav_ns":
        other[field] = own[field]
    other["slots_from_ns"] = own["slots_from_ns"] + setup["slot_ns"] * (
        int(other["aifsn"]) - int(own["aifsn"]))
    other["radio"], other["next"], own["next"] = radio, own["next"], number
    blocks, due = len(state.due) // (1 + BLOCK), no_events(number + 1)
    more = len(due) // (1 + BLOCK)
    due[:blocks], due[more:more + number] = -1, state.due[blocks:blocks + number]
    return state._replace(stations=stations, due=due, **{
        name: _longer(getattr(state, name), 1) for name in ("times", "packets")
        if len(getattr(state, name))})


def _longer(array: np.ndarray, rows: int) -> np.ndarray:
    return np.concatenate([array, np.zeros((rows, *array.shape[1:]), array.dtype)])
