"""The fate of a frame in a sender's queue, packet by packet."""

from __future__ import annotations

from collections.abc import Sequence

from desim import ports
from netmodels.partial_trains import settle_without
from netmodels.radio.dcf.stations import DROPPED, EXPIRED, GIVEN_UP, LAPSED, MISSED, RECEIVED

_ARRIVED, _COLLISION = ports.Deliver(0), ports.Drop("collision")
_ERROR = ports.Drop("channel_error")
_OUT_OF_REACH = ports.Drop("out_of_reach")


class QueuedFrame:
    """The first ``packets`` of a frame in a sender's queue. ``given_up`` and ``expired`` are
    packets of a unicast frame. Of a broadcast by receiver, bit k for packet
    k: those ``got``, and those ``lost`` for a reason."""

    __slots__ = ("frame", "packets", "given_up", "expired", "got", "lost")

    def __init__(self, frame: ports.Frame, packets: int) -> None:
        self.frame, self.packets = frame, packets
        self.given_up: list[int] = []
        self.expired: list[int] = []
        self.got: dict[int, int] = {}
        self.lost: dict[str, dict[int, int]] = {}

    def note(self, what: int, receiver: int, packet: int) -> bool:
        """Note an outcome. Returns whether the frame has left the queue."""
        if what == RECEIVED:
            if not self.frame.broadcast:
                return True
            self.got[receiver] = self.got.get(receiver, 0) | 1 << packet
            return False
        if what in (DROPPED, GIVEN_UP):
            self.given_up.append(packet)
            return what == DROPPED and packet == self.packets - 1
        if what == LAPSED:
            self.expired.append(packet)
            return False
        if what == MISSED:
            self.lose("channel_error", receiver, packet)
            return False
        if what == EXPIRED:
            self.expired.extend(range(packet, self.packets))
        return True

    def lose(self, reason: str, receiver: int, packet: int) -> None:
        """A packet of a broadcast is lost at a receiver that has found it."""
        packets = self.lost.setdefault(reason, {})
        packets[receiver] = packets.get(receiver, 0) | 1 << packet

    def packet(self, number: int, receiver: int) -> ports.Frame:
        """One of its packets, on the way to one receiver."""
        frame = self.frame
        sizes = ports.packet_sizes(frame.size_bytes, frame.segments)
        return frame._replace(receivers=(receiver,), size_bytes=sizes[number], segments=1)

    def settle(self, context: ports.Context) -> None:
        """Settle a unicast frame: packets that were given up or expired are lost."""
        frame = self.frame
        if self.given_up or self.expired:
            settle_without(context, frame, frame.receivers[0], {
                "retry_limit": self.given_up, "expired": self.expired}, sent=self.packets)
        else:
            context.settle(frame, frame.receivers[0], _ARRIVED)

    def settle_packet(self, context: ports.Context, received: list[int], missed: list[int],
                      finders: Sequence[int]) -> None:
        """``settle_broadcast`` of one packet that these stations have ``received`` or ``missed``
        for its errors, both ascending."""
        frame, settle = self.frame, context.settle_many
        among = frame.among
        buried = set(finders).difference(received, missed)
        arrived = among(received)
        if arrived:
            settle(frame, arrived, _ARRIVED)
        if missed and (lost := among(missed)):
            settle(frame, lost, _ERROR)
        if buried and (lost := among(sorted(buried))):
            settle(frame, lost, _COLLISION)
        settle(frame, None, _OUT_OF_REACH)

    def settle_broadcast(self, context: ports.Context, finders: Sequence[int]) -> None:
        """Settle a broadcast. Where ``finders`` have found nothing of it, others were louder."""
        frame, got = self.frame, self.got
        among, whole = frame.among, (1 << self.packets) - 1

        def at(packets: dict[int, int]) -> list[int]:
            """The receivers at which this is the fate of all packets."""
            hosts = sorted(packets)
            return among(hosts if whole == 1 else [
                host for host in hosts if packets[host] == whole])

        fates: list[tuple[ports.Deliver | ports.Drop, list[int]]] = [(_ARRIVED, at(got))]
        fates += [(ports.Drop(reason), at(packets))
                  for reason, packets in sorted(self.lost.items())]
        known = {host for _, hosts in fates for host in hosts}
        if self.packets > 1:
            found = {*got, *(host for packets in self.lost.values() for host in packets)}
            parted = among(sorted(found - known))
            self._settle_parts(context, parted)
            known.update(parted)
        fates.append((_COLLISION, among([host for host in finders if host not in known])))
        for fate, receivers in fates:
            if receivers:
                context.settle_many(frame, receivers, fate)
        context.settle_many(frame, None, _OUT_OF_REACH)

    def _settle_parts(self, context: ports.Context, receivers: Sequence[int]) -> None:
        """Settle where not all packets have had the same fate."""
        frame = self.frame
        for receiver in receivers:
            lost = {reason: packets[receiver] for reason, packets in sorted(self.lost.items())
                    if receiver in packets}
            unheard = ~(self.got.get(receiver, 0) | sum(lost.values()))
            settle_without(context, frame, receiver, {
                reason: [packet for packet in range(self.packets) if bits >> packet & 1]
                for reason, bits in {**lost, "collision": unheard}.items()}, sent=self.packets)
