"""A shared bus, one cable for all hosts: its model, ``Bus``, and its arbitrations."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Literal

from pydantic import Field

from desim import ports
from desim.errors import InputError
from desim.units import NS_PER_S, BitRate, ByteSize, Duration, airtime_ns
from netmodels.bus.collisions import JAM_BITS, SLOT_BITS, CollisionDetection
from netmodels.bus.fifo import Fifo
from netmodels.bus.sense import CarrierSense
from netmodels.bus.stations import Cable
from netmodels.ethernet import padded

Arbitration = CarrierSense | CollisionDetection | Fifo
Discipline = Callable[[Cable, ports.Context, tuple[str, ...]], Arbitration]
ARBITRATIONS: dict[str, Discipline] = {
    "csma": CarrierSense, "csma_cd": CollisionDetection, "fifo": Fifo}


class Bus:
    """One cable for all hosts, one packet at a time; a broadcast is one transmission.

    With ``csma`` and ``csma_cd`` a train competes for the bus packet by packet, and one that is
    given up is lost alone; with ``fifo`` it goes in one go.

    A packet that finds ``queue_packets`` waiting is dropped, and of a train all those for which the
    queue has no place.

    Capabilities: Refuses, CountsAttempts, CountsBusyTime.
    """

    class Params(ports.Params):
        arbitration: Literal["csma", "csma_cd", "fifo"] = Field(
            "csma_cd", description="who sends next: without collisions as in ns-3, as in IEEE "
                                   "802.3, or in order of sending (IEEE 802.3)")
        rate_bps: BitRate = Field("10 Mb/s", description="of the bus (10BASE5)")
        propagation_ns: Duration = Field("1 us", description="between any two hosts (200 m at "
                                                             "2e8 m/s)")
        queue_packets: int = Field(100, ge=1, description="that wait at a sender, or with fifo in "
                                                          "all, beside the one that is being sent "
                                                          "(ns-3 DropTailQueue)")
        preamble_bytes: ByteSize = Field("8 B", description="before each packet (IEEE 802.3; 0 B "
                                                            "in ns-3)")
        gap_bytes: ByteSize = Field("12 B", description="of silence after each packet: 9.6 us at "
                                                        "10 Mb/s (IEEE 802.3)")

    reasons = ("queue_full", "excessive_backoff", "excessive_collisions")
    refuses = ("queue_full",)

    def __init__(self, params: Params) -> None:
        self._params = params

    def start(self, context: ports.Context, hosts: tuple[str, ...]) -> None:
        """Raises ``InputError`` if collisions could go unheard."""
        params = self._params
        slot_ns, jam_ns, gap_ns = (-(-bits * NS_PER_S // params.rate_bps) for bits in (
            SLOT_BITS, JAM_BITS, 8 * params.gap_bytes))
        if params.arbitration == "csma_cd" and 2 * params.propagation_ns + jam_ns > slot_ns:
            raise InputError(f".propagation: twice {params.propagation_ns} ns and the jam of "
                             f"{jam_ns} ns must fit into a slot of 512 bits, {slot_ns} ns at this "
                             "rate")
        cable = Cable(params.propagation_ns, gap_ns, slot_ns, jam_ns, params.queue_packets,
                      self._wire_ns)
        self._context = context
        self._arbitration = self._discipline()(cable, context, hosts)

    def send(self, frame: ports.Frame) -> None:
        self._arbitration.take(frame)

    def attempts(self) -> tuple[int, int]:
        """The number of packets begun so far, and how many of them collided."""
        return self._arbitration.transmissions, self._arbitration.collisions

    def busy_ns(self, hosts: Sequence[int]) -> list[int]:
        """For how long nobody could begin: a host was sending (with success or not), a signal was
        under way, or the gap behind it was not over (``csma``: only the sender waits for that)."""
        bus = self._arbitration
        return [bus.taken_ns - max(bus.free_ns - self._context.now_ns, 0)]

    def _discipline(self) -> Discipline:
        """The class of the arbitration."""
        return ARBITRATIONS[self._params.arbitration]

    def _wire_ns(self, size_bytes: int) -> int:
        params = self._params
        return airtime_ns(padded(size_bytes) + params.preamble_bytes, params.rate_bps)
