"""Who is on which channel."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from desim.errors import InputError, did_you_mean


def channels_of(hosts: tuple[str, ...], channel: int, by_host: dict[str, int], apart: int
                ) -> np.ndarray:
    """[hosts] their channels' numbers: ``by_host``, or ``channel``. Raises ``InputError`` for an
    unknown host and for different channels less than ``apart`` from each other."""
    for host in by_host:
        if host not in hosts:
            raise InputError(f".channels: no host {host!r}{did_you_mean(host, hosts)}")
    for one, other in pairwise(sorted({*by_host.values(), channel})):
        if other - one < apart:
            raise InputError(f".channels: {one} and {other} overlap, which this model knows "
                             f"nothing of; allowed: the same, or {apart} and more apart")
    return np.array([by_host.get(host, channel) for host in hosts])
