"""Frames on their way: the model has said when they will be at a receiver."""

from __future__ import annotations

from array import array
from collections.abc import Collection, Sequence
from functools import partial
from typing import TypeVar

from desim.engine.kernel import Kernel, Phase
from desim.network.account import Account
from desim.network.carrier import BroadcastCarrier, Carrier
from desim.network.terms import PLAIN, Claim
from desim.ports import packet_sizes

T = TypeVar("T")

_DELIVER = Phase.DELIVER  # cheaper than to look it up each time


class Flights:
    """Books the arrivals of frames, or tells them to carriers ahead of time; enters what arrives in
    ``account``. ``ids`` are the trace ids of hosts, ``up`` says which of them run, ``count`` is the
    number of receptions to come. ``landed((receiver, size_bytes, segments))`` notes a frame that
    arrived when its carrier expected it."""

    __slots__ = ("up", "count", "landed", "_landed", "_account", "_kernel", "_after", "_ids",
                 "_packed_ids", "_sources", "_arrives")

    def __init__(self, account: Account, kernel: Kernel, ids: list[int]) -> None:
        self.up = [True] * len(ids)
        self.count = 0
        self._landed: list[tuple[int, int, int]] = []
        self.landed = self._landed.append
        self._account, self._kernel = account, kernel
        self._ids = ids
        self._packed_ids = array("I", ids)  # for many at once: all are close together
        self._sources = [id_ << 32 for id_ in ids]  # in the entity of a delivery
        self._after, self._arrives = kernel.after, self._deliver  # bound once: 400 instructions

    def begin(self, source: int, claim: Claim, delay_ns: int) -> None:
        """A frame on which no rule has terms arrives after ``delay_ns``. Raises ``KernelError``
        for a wrong delay."""
        self.count += 1
        carrier, token, receiver, _, _, _ = claim  # a slice takes longer
        if carrier.ahead and type(delay_ns) is int and delay_ns > 0:
            carrier.expected(token, receiver, self._kernel.now_ns + delay_ns)
        else:
            after = self._after
            after(delay_ns, _DELIVER, self._sources[source] | self._ids[receiver], self._arrives,
                  claim)

    def begin_on_terms(self, source: int, claim: Claim, delay_ns: int) -> None:
        """The same for a frame that rules may have delayed or copied; it is dropped if they and the
        model have lost all its packets between them."""
        rules_ns, copies_ns, lost, _ = claim[5]
        if len(lost) == claim[4]:
            reason = next(iter(lost.values()))
            self._account.count_drops(reason, 1, 0)
            claim[0].lost(claim[1], claim[2], reason)
            return
        self.count += 1
        entity = self._sources[source] | self._ids[claim[2]]
        if copies_ns and not lost:
            self._after(delay_ns + rules_ns, _DELIVER, entity, self._deliver_often, (entity, claim))
        else:
            self._after(delay_ns + rules_ns, _DELIVER, entity, self._arrives, claim)

    def begin_all(self, source: int, carrier: BroadcastCarrier[T], token: T,
                  receivers: Collection[int], size_bytes: int, segments: int, delay_ns: int
                  ) -> None:
        """``begin`` for each receiver of a broadcast, all in one event."""
        if carrier.ahead:
            for receiver in receivers:
                self.begin(source, (carrier, token, receiver, size_bytes, segments, PLAIN),
                           delay_ns)
            return
        self.count += len(receivers)
        ids, own = self._packed_ids, self._sources[source]
        receivers = sorted(receivers, key=ids.__getitem__)
        self._kernel.after_all(delay_ns, _DELIVER, [own | ids[host] for host in receivers],
                               partial(self._deliver_all, carrier, token, size_bytes, segments),
                               receivers)

    def book(self, source: int, receiver: int, size_bytes: int, segments: int, carrier: Carrier[T],
             token: T, arrival_ns: int) -> None:
        """Call ``carrier`` when a frame arrives that it has expected so far."""
        self._kernel.at(arrival_ns, _DELIVER, self._sources[source] | self._ids[receiver],
                        self._arrives, (carrier, token, receiver, size_bytes, segments, PLAIN))

    def catch_up(self) -> None:
        """Enter the frames that have ``landed``."""
        landed, account = self._landed, self._account
        self.count -= len(landed)
        account.delivered += len(landed)
        for receiver, size_bytes, segments in landed:
            account.packets_delivered += segments
            account.rx_bytes[receiver] += size_bytes
        landed.clear()

    def landed_each(self, receivers: Sequence[int], size_bytes: int, segments: int,
                    frames: Sequence[int]) -> None:
        """Enter frames that landed at several receivers, so many equal ones at each."""
        account, total = self._account, sum(frames)
        self.count -= total
        account.delivered += total
        account.packets_delivered += total * segments
        for receiver, count in zip(receivers, frames, strict=True):
            account.rx_bytes[receiver] += count * size_bytes

    def _deliver(self, claim: Claim) -> None:
        """A frame is at one receiver."""
        carrier, token, receiver, size_bytes, segments, terms = claim
        account = self._account
        self.count -= 1
        if not self.up[receiver]:
            account.count_drops("host_down", 1, segments - len(terms.lost))
            carrier.lost(token, receiver, "host_down")
            return
        account.delivered += 1
        if terms is not PLAIN and terms.lost:
            self._deliver_in_part(claim)
            return
        account.packets_delivered += segments
        account.rx_bytes[receiver] += size_bytes
        carrier.arrived(token, receiver)

    def _deliver_all(self, carrier: BroadcastCarrier[T], token: T, size_bytes: int, segments: int,
                     receivers: Sequence[int]) -> None:
        """A broadcast is at several receivers."""
        if not all(map(self.up.__getitem__, receivers)):
            for receiver in receivers:
                self._deliver((carrier, token, receiver, size_bytes, segments, PLAIN))
            return
        account, count = self._account, len(receivers)
        self.count -= count
        account.delivered += count
        account.packets_delivered += count * segments
        rx_bytes = account.rx_bytes
        for receiver in receivers:
            rx_bytes[receiver] += size_bytes
        carrier.arrived_many(token, receivers)

    def _deliver_in_part(self, claim: Claim) -> None:
        """Some packets of a train are at one receiver."""
        carrier, token, receiver, size_bytes, segments, terms = claim
        sizes = packet_sizes(size_bytes, segments)
        account = self._account
        account.packets_delivered += segments - len(terms.lost)
        account.rx_bytes[receiver] += size_bytes - sum(sizes[number] for number in terms.lost)
        carrier.arrived_in_part(token, receiver, dict(sorted(terms.lost.items())))

    def _deliver_often(self, arrival: tuple[int, Claim]) -> None:
        """A frame that has copies is at one receiver. They come after it, if it comes."""
        entity, claim = arrival
        if self.up[claim[2]]:
            for after_ns in claim[5].copies_ns:
                self._after(after_ns, _DELIVER, entity, self._repeat, claim)
        self._deliver(claim)

    def _repeat(self, claim: Claim) -> None:
        """A copy is at one receiver."""
        carrier, token, receiver, size_bytes, *_ = claim
        if self.up[receiver]:
            self._account.copies += 1
            self._account.rx_bytes[receiver] += size_bytes
            carrier.repeated(token, receiver)
