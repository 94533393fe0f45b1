"""Random numbers of links, which do not depend on what other pairs of hosts send."""

from __future__ import annotations

import numpy as np

from desim import ports


class PairStreams:
    """A random stream for each ordered pair of hosts, named by ``use`` and the two. The k-th frame
    of a link draws the same numbers, no matter what others send or how hosts were declared."""

    def __init__(self, context: ports.RuleContext, use: str, hosts: tuple[str, ...]) -> None:
        self._context = context
        self._use = use
        self._hosts = hosts
        self._streams: dict[tuple[int, int], np.random.Generator] = {}

    def __call__(self, source: int, receiver: int) -> np.random.Generator:
        stream = self._streams.get((source, receiver))
        if stream is None:
            stream = self._streams[source, receiver] = self._context.stream(
                self._use, self._hosts[source], self._hosts[receiver])
        return stream
