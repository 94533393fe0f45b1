"""Utilisation of the media: the share of time in which each part is busy.

A part does one thing at a time: the air around a host, a port in one direction, a cable.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from desim.errors import ModelError, class_of
from desim.network.medium import Medium
from desim.ports import CountsBusyTime, NamesChannels


def busy_ns(medium: Medium) -> np.ndarray | None:
    """[parts] ns for which each has been in use so far; None: the model does not count that."""
    if not isinstance(medium.model, CountsBusyTime):
        return None
    busy = np.asarray(medium.model.busy_ns(medium.attached))
    if busy.ndim != 1 or busy.size and busy.dtype.kind not in "iu":
        raise ModelError(f"{class_of(medium.model)} was busy for {busy.tolist()!r}; wanted: a list "
                         "of whole nanoseconds")
    return busy.astype(np.int64)


def channels(medium: Medium, count: int) -> Sequence[str]:
    """The names of the ``count`` parts of ``busy_ns``. Raises ``ModelError`` for as many as there
    are neither hosts nor names."""
    if count == 1:
        return [medium.name.partition("@")[2] or medium.name]
    names = (medium.model.channels(medium.attached) if isinstance(medium.model, NamesChannels)
             else [medium.hosts[index] for index in medium.attached])
    if len(names) != count:
        raise ModelError(f"{class_of(medium.model)} was busy on {count} channels, and has names of "
                         f"{len(names)} (ports.NamesChannels)")
    return names


def utilisation(medium: Medium, elapsed_ns: int,
                before_ns: np.ndarray | int = 0) -> dict[str, float] | None:
    """``mean`` and ``max`` over the parts of ``medium``, of ``elapsed_ns`` at whose beginning
    ``busy_ns`` was ``before_ns``. None: its model does not say."""
    busy = busy_ns(medium)
    if busy is None or not len(busy) or not elapsed_ns:
        return None
    shares = (busy - before_ns) / elapsed_ns
    return {"mean": float(shares.mean()), "max": float(shares.max())}


def utilisation_inside(media: Sequence[Medium], elapsed_ns: int
                       ) -> dict[str, dict[str, float] | None]:
    """``utilisation`` of media inside hosts, all of one name together: ``bus@robot_3`` is one of
    ``bus``."""
    of_all: dict[str, list[dict[str, float] | None]] = {}
    for medium in media:
        of_all.setdefault(medium.name.partition("@")[0], []).append(utilisation(medium, elapsed_ns))
    out: dict[str, dict[str, float] | None] = {}
    for name, each in of_all.items():
        known = [one for one in each if one is not None]
        out[name] = {"mean": float(np.mean([one["mean"] for one in known])),
                     "max": max(one["max"] for one in known)} if known else None
    return out
