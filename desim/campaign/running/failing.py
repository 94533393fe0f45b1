"""The levels of a campaign with which no run can start, found before it begins."""

from __future__ import annotations

from collections.abc import KeysView

from desim.campaign.design.plan import Plan, Vector
from desim.campaign.design.rehearsal import Made, Rehearsal
from desim.campaign.running.agenda import Agenda
from desim.errors import InputError


def failing(plan: Plan, agenda: Agenda, tried: dict[int, str | None], made: Made) -> dict[str, str]:
    """The first error of each failing level, such as ``robots=30``, and of vectors that fail though
    each of their levels is fine. ``tried``: the errors of vectors that were run, by number; None of
    those that are fine. A level of which none of these is fine is rehearsed once more, where it
    can be with levels that are."""
    vectors = {vector.number: vector for vector, _, _ in agenda.runs}
    by_level: dict[str, list[Vector]] = {}
    for vector in vectors.values():
        for level in _levels(vector):
            by_level.setdefault(level, []).append(vector)
    fine = {level for number, error in tried.items() if error is None
            for level in _levels(vectors[number])}
    errors: dict[str, str] = {}
    for level in (*by_level, *by_level):  # again, for those tried while no other was known as fine
        if level in fine:
            continue
        vector = min(by_level[level], key=lambda vector: len(_levels(vector) - fine))
        if vector.number not in tried:
            tried[vector.number] = _error(plan, vector, made)
        error = tried[vector.number]
        if error is None:
            fine |= _levels(vector)
        else:
            errors[level] = error
    own = {", ".join(_levels(vectors[number])) or "the only vector": error
           for number, error in tried.items() if error and _levels(vectors[number]) <= fine}
    return {level: error for level, error in errors.items() if level not in fine} | own


def _levels(vector: Vector) -> KeysView[str]:
    return {f"{name}={level.label}": None for name, level in vector.levels.items()}.keys()


def _error(plan: Plan, vector: Vector, made: Made) -> str | None:
    try:
        row = made(Rehearsal(plan.run_id(vector, 0), plan.scenario(vector, 0), ()))
    except InputError as error:
        return str(error)
    return row.get("error")
