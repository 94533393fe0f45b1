"""Frames on their way: the model has said when they will be at a receiver."""

from __future__ import annotations

from array import array
from collections.abc import Collection, Sequence
from functools import partial
from typing import TypeVar

from desim.engine.kernel import Kernel, Phase
from desim.network.account import Account
from desim.network.carrier import Carrier
from desim.network.terms import PLAIN, RECEIVER, TERMS, Claim
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
        carrier, token, receiver, _, segments, terms = claim
        rules_ns, copies_ns, lost, _ = terms
        if len(lost) == segments:
            reason = next(iter(lost.values()))
            self._account.count_drops(reason, 1, 0)
            carrier.lost(token, receiver, reason)
            return
        self.count += 1
        entity = self._sources[source] | self._ids[receiver]
        if copies_ns and not lost:
            self._after(delay_ns + rules_ns, _DELIVER, entity, self._deliver_often, (entity, claim))
        else:
            self._after(delay_ns + rules_ns, _DELIVER, entity, self._arrives, claim)

    def begin_all(self, source: int, carrier: Carrier[T], token: T,
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
        landed = self._landed
        self.count -= len(landed)
        self._account.count_arrivals(len(landed), landed)
        landed.clear()

    def landed_each(self, receivers: Sequence[int], size_bytes: int, segments: int,
                    frames: Sequence[int]) -> None:
        """Enter frames that landed at several receivers, so many equal ones at each."""
        total = sum(frames)
        self.count -= total
        account = self._account
        account.delivered += total
        account.packets_delivered += total * segments
        for receiver, count in zip(receivers, frames, strict=True):
            account.rx_bytes[receiver] += count * size_bytes

    def _deliver(self, claim: Claim) -> None:
        """A frame, or some packets of a train, are at one receiver."""
        carrier, token, receiver, size_bytes, segments, terms = claim
        self.count -= 1
        lost = terms.lost
        if not self.up[receiver]:
            self._account.count_drops("host_down", 1, segments - len(lost))
            carrier.lost(token, receiver, "host_down")
        elif lost:
            sizes = packet_sizes(size_bytes, segments)
            left_bytes = size_bytes - sum(sizes[number] for number in lost)
            self._account.count_arrivals(1, ((receiver, left_bytes, segments - len(lost)),))
            carrier.arrived_in_part(token, receiver, dict(sorted(lost.items())))
        else:
            account = self._account  # ``count_arrivals`` without its call
            account.delivered += 1
            account.packets_delivered += segments
            account.rx_bytes[receiver] += size_bytes
            carrier.arrived(token, receiver)

    def _deliver_all(self, carrier: Carrier[T], token: T, size_bytes: int, segments: int,
                     receivers: Sequence[int]) -> None:
        """A broadcast is at several receivers."""
        if not all(map(self.up.__getitem__, receivers)):
            for receiver in receivers:
                self._deliver((carrier, token, receiver, size_bytes, segments, PLAIN))
            return
        self.count -= len(receivers)
        self._account.count_arrivals(len(receivers), [(receiver, size_bytes, segments)
                                                      for receiver in receivers])
        carrier.arrived_many(token, receivers)

    def _deliver_often(self, arrival: tuple[int, Claim]) -> None:
        """A frame that has copies is at one receiver. They come after it, if it comes."""
        entity, claim = arrival
        if self.up[claim[RECEIVER]]:
            for after_ns in claim[TERMS].copies_ns:
                self._after(after_ns, _DELIVER, entity, self._repeat, claim)
        self._deliver(claim)

    def _repeat(self, claim: Claim) -> None:
        """A copy is at one receiver."""
        carrier, token, receiver, size_bytes, *_ = claim
        if self.up[receiver]:
            self._account.copies += 1
            self._account.rx_bytes[receiver] += size_bytes
            carrier.repeated(token, receiver)
