"""The account of a medium: the fates of frames and packets at each intended receiver."""

from __future__ import annotations

from array import array
from collections.abc import Callable, Iterable


class Account:
    """Counts per intended receiver, which are conserved:

        intended = delivered + dropped by reason + in flight            (frames)
        packets_intended = packets_delivered + packets_dropped + ...    (packets)

    A train of which a part arrives counts as delivered; its lost packets are in
    ``packets_dropped``. ``bytes_on_air`` are those of packets that the rules let through to
    somebody, with headers; ``tx_bytes`` and ``rx_bytes`` are by host. ``refused_bytes`` were sent
    by nobody: the model refused them (``ports.Refuses``). ``copies`` that rules made of delivered
    frames are counted apart, but for ``rx_bytes``. Beyond the first ``own`` hosts are those of
    others: what they send is in ``background_bytes``, and not on the air or refused.
    """

    __slots__ = ("intended", "delivered", "dropped", "packets_intended", "packets_delivered",
                 "packets_dropped", "copies", "tx_bytes", "rx_bytes", "refused_bytes",
                 "barred_bytes", "own", "on_refusal")

    def __init__(self, hosts: int, own: int | None = None) -> None:
        self.own = hosts if own is None else own
        self.intended = self.delivered = 0
        self.dropped: dict[str, int] = {}
        self.packets_intended = self.packets_delivered = 0
        self.packets_dropped: dict[str, int] = {}
        self.copies = 0
        self.tx_bytes = [0] * hosts
        self.rx_bytes = array("q", bytes(8 * hosts))
        self.refused_bytes = 0
        self.on_refusal: list[Callable[[int, int], object]] = []  # who else counts what is sent
        self.barred_bytes = [0] * hosts  # of packets that the rules let through to nobody

    @property
    def bytes_on_air(self) -> int:
        return sum(self.tx_bytes[:self.own]) - sum(self.barred_bytes[:self.own])

    @property
    def background_bytes(self) -> int:
        return sum(self.tx_bytes[self.own:]) - sum(self.barred_bytes[self.own:])

    def count_arrivals(self, frames: int, shares: Iterable[tuple[int, int, int]]) -> None:
        """So many ``frames`` have arrived: bytes and packets at each receiver."""
        self.delivered += frames
        for receiver, size_bytes, packets in shares:
            self.packets_delivered += packets
            self.rx_bytes[receiver] += size_bytes

    def count_drops(self, reason: str, frames: int, packets: int) -> None:
        """``frames`` and ``packets`` do not arrive, for ``reason``."""
        if frames:
            self.dropped[reason] = self.dropped.get(reason, 0) + frames
        self.packets_dropped[reason] = self.packets_dropped.get(reason, 0) + packets

    def count_refused(self, source: int, size_bytes: int) -> None:
        """The model refused ``size_bytes`` of ``source``."""
        self.refused_bytes += size_bytes * (source < self.own)
        self.tx_bytes[source] -= size_bytes
        for refused in self.on_refusal:
            refused(source, size_bytes)
