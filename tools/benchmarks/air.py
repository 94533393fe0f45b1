"""What does a frame on a radio cost? Hosts on one channel, through the whole medium."""

from __future__ import annotations

import time
from typing import Any

import numpy as np

from desim.engine.kernel import Phase
from desim.netcases.case import play
from desim.testing import Bench
from netmodels.radio.radio import Radio
from netmodels.validation import access_points

UDP_BYTES = 1046  # 1000 B of UDP with Ethernet's headers: 1064 B on the air
MESSAGE = 20_004 + 14 * 70, 14  # 20 kB over TCP: bytes with headers, segments
SAME_ROOM = {"path_loss": {"model": "fixed", "total": "60 dB"}}


class Air(Bench):
    """Counts what arrives instead of logging it."""

    def __init__(self, places: dict[str, tuple[float, float]] | int, **params: Any) -> None:
        self.radio = Radio.build(Radio.Params(**params))
        super().__init__(self.radio, places)
        self._everybody = tuple(range(len(self.hosts)))

    def arrived(self, token: Any, receiver: int) -> None: ...

    def arrived_in_part(self, token: Any, receiver: int, lost: Any) -> None: ...

    def lost(self, token: Any, receiver: int, reason: str) -> None: ...

    def missed(self, token: Any, receivers: Any, reason: str, medium: Any) -> None: ...

    def spent_s(self, warm_up_s: float, simulated_s: float) -> float:
        """CPU time of ``simulated_s``, after ``warm_up_s``."""
        self.kernel.run(round(warm_up_s * 1e9))
        start = time.process_time()
        self.kernel.run(round((warm_up_s + simulated_s) * 1e9))
        return time.process_time() - start

    def audience(self) -> tuple[float, float]:
        """The mean number of hosts that hear another one, and of those that receive its frames."""
        medium, hosts = self.medium, len(self._everybody)
        links = self.radio.budget.links(medium.positions(medium.now_ns), medium.obstacles)
        return len(links.hearer) / hosts, len(links.finder) / hosts

    def send_every(self, hz: int, size_bytes: int, segments: int, broadcast: bool) -> None:
        """Each host sends so often, from a random phase, to all others or to the next one."""
        draw, hosts = np.random.default_rng(1), self._everybody
        for host in hosts:
            to = (hosts[:host] + hosts[host + 1:] if broadcast
                  else (hosts[(host + 1) % len(hosts)],))

            def send(k: int, host: int = host, to: tuple[int, ...] = to) -> None:
                self.medium.transmit(host, to, size_bytes, segments, broadcast, self, None)

            self.kernel.ticker(hz, Phase.CONTROL, host, send, int(draw.integers(10**9 // hz)))


class Saturated(Air):
    """All but the first host have two packets for it in their queues, always."""

    def start(self) -> None:
        for source in self._everybody[1:] * 2:
            self._offer(source)

    def arrived(self, token: int, receiver: int) -> None:
        self._offer(token)

    def lost(self, token: int, receiver: int, reason: str) -> None:
        self._offer(token)

    def _offer(self, source: int) -> None:
        self.medium.transmit(source, (0,), UDP_BYTES, 1, False, self, source)


def saturated(stations: int, simulated_s: float) -> float:
    """CPU time of so many senders of 802.11g at 54 Mb/s."""
    air = Saturated(stations + 1, **SAME_ROOM)
    air.start()
    return air.spent_s(0.2, simulated_s)


def messages(hosts: int, hz: int, simulated_s: float) -> float:
    """CPU time of hosts that each send messages of 20 kB so often."""
    air = Air(hosts, **SAME_ROOM)
    air.send_every(hz, *MESSAGE, broadcast=False)
    return air.spent_s(1.0, simulated_s)


def under_an_access_point(direction: str, simulated_s: int) -> float:
    """CPU time of 30 saturated stations of 802.11n with A-MPDU, ``up``, ``down`` or ``both``."""
    setup = access_points.saturated(direction, 30, simulated_s - 1)
    start = time.process_time()
    play(setup)
    return time.process_time() - start
