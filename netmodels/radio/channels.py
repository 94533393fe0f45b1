"""The channels of hosts."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from desim.errors import InputError, did_you_mean
from netmodels.radio.standards import Standard


def channels_of(hosts: tuple[str, ...], channel: int, by_host: dict[str, int], standard: Standard
                ) -> np.ndarray:
    """[hosts] their channels' numbers: ``by_host``, or ``channel``. Raises ``InputError`` for an
    unknown host, for channels that the standard does not have, and for different ones that overlap.
    """
    for host in by_host:
        if host not in hosts:
            raise InputError(f".channels: no host {host!r}{did_you_mean(host, hosts)}")
    last, apart = standard.last_channel, standard.channels_apart
    for key, number in (("channel", channel), *((f"channels.{host}", number)
                                                for host, number in by_host.items())):
        if number > last:
            raise InputError(f".{key}: there is no channel {number} in this band; allowed: 1 to "
                             f"{last}")
    for one, other in pairwise(sorted({*by_host.values(), channel})):
        if other - one < apart:
            raise InputError(f".channels: {one} and {other} overlap, which this model knows "
                             f"nothing of; allowed: the same, or {apart} and more apart")
    return np.array([by_host.get(host, channel) for host in hosts])
