"""The single hops underneath: a model of the air, and the context that it works in."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterable, Sequence
from contextlib import nullcontext
from operator import attrgetter

import numpy as np

from desim import ports
from desim.errors import below

# Called with a frame's fate at some receivers of one hop, and with the packets of a train that were
# lost on it (number to reason).
Report = Callable[[ports.Frame, Sequence[int], ports.Deliver | ports.Drop, dict[int, str]], None]


HopPart = tuple[ports.TimePart, int, int]  # ns, and the host where they were spent


class _Leg:
    """A frame of our own on the air: the function to call with its fate, the number of the medium's
    frame that it carries, its mark, the receivers at which it is settled, and the packets that are
    lost, of a broadcast by receiver."""

    def __init__(self, report: Report, carries: int, dscp: int) -> None:
        self.report, self.carries, self.dscp = report, carries, dscp
        self.settled: list[int] = []
        self.lost: dict[int, str] = {}
        self.lacking: dict[int, dict[int, str]] = {}


class HopLedger:
    """The ledger that the hop model sees. Parts of the medium's own frames go on to ``ledger``;
    those of the frames sent here are kept until their hop is over."""

    def __init__(self, ledger: ports.Ledger, itemized: bool) -> None:
        self._ledger, self._itemized = ledger, itemized
        self._sent_ns: dict[int, int] = {}
        self._parts: dict[int, list[tuple[ports.TimePart, int, int | None]]] = {}

    def spent(self, frame: ports.Frame, part: ports.TimePart, time_ns: int,
              receiver: int | None = None, host: int | None = None) -> None:
        if frame.id > 0:
            self._ledger.spent(frame, part, time_ns, receiver, host)
        elif frame.id in self._parts:
            self._parts[frame.id].append((part, time_ns, receiver))

    def lost_at(self, frame: ports.Frame, host: int, receiver: int | None = None) -> None:
        if frame.id > 0:
            self._ledger.lost_at(frame, host, receiver)

    def begin(self, frame: ports.Frame, now_ns: int) -> None:
        """A frame is sent here."""
        self._sent_ns[frame.id] = now_ns
        self._parts[frame.id] = []

    def pass_on(self, frame: ports.Frame, parts: Iterable[HopPart]) -> None:
        """A frame of the medium has spent its time in these parts."""
        for part, time_ns, host in parts:
            self._ledger.spent(frame, part, time_ns, host=host)

    def parts(self, leg: ports.Frame, arrives_ns: int, receiver: int | None = None
              ) -> list[HopPart]:
        """The parts of the time of a frame that was sent here and will be there at ``arrives_ns``:
        at a ``receiver``, or at its only one."""
        parts = self._parts[leg.id]
        if not self._itemized:
            parts = [(ports.TimePart.MEDIUM, arrives_ns - self._sent_ns[leg.id], None)]
        return [(part, time_ns, leg.source) for part, time_ns, own in parts
                if own is None or receiver in (None, own)]

    def begun_ns(self, leg: ports.Frame) -> int:
        """The time when a frame was sent here."""
        return self._sent_ns[leg.id]

    def end(self, frame: ports.Frame) -> None:
        """A frame that was sent here is settled."""
        del self._sent_ns[frame.id], self._parts[frame.id]


class Hops:
    """Sends frames over one hop and reports their fates; to the hop model it is the context.

    Frames of the medium may be sent as they are (``model.send``), and are settled there. Frames
    that are sent here have negative numbers. Hosts that are not ``up`` have no place; to each host
    there are ``others``. ``refuses`` are the model's. With ``marks`` frames that are sent here have
    marks even if the medium's have none.
    """

    def __init__(self, model: ports.NetworkModel, context: ports.Context, hosts: tuple[str, ...],
                 block: str = "", ledger: HopLedger | None = None, marks: bool = False) -> None:
        """Starts ``model``. Raises ``InputError`` for its parameters, at the path ``block``."""
        self._context, self._ledger = context, ledger
        self._model = model
        self.refuses = frozenset(getattr(model, "refuses", ()))
        self.up = [True] * len(hosts)
        self.others = [tuple(other for other in range(len(hosts)) if other != host)
                       for host in range(len(hosts))]
        self._last = 0
        self._open: dict[int, _Leg] = {}
        self._places = np.empty((0, 2))
        self._seen: np.ndarray | None = None
        self.at, self.stream = context.at, context.stream
        self.judge_transmission = context.judge_transmission and self._judge
        self.dscp = self._dscp if marks or context.dscp else None
        self.shared = context.shared
        with below(block) if block else nullcontext():
            model.start(self, hosts)

    now_ns = property(attrgetter("_context.now_ns"))
    obstacles = property(attrgetter("_context.obstacles"))
    antennas = property(attrgetter("_context.antennas"))

    def left(self, frame: ports.Frame) -> None:
        """A frame has left its sender: the model on top says when those of the medium have."""

    def send(self, source: int, receivers: tuple[int, ...], size_bytes: int, segments: int,
             broadcast: bool, report: Report, carries: int | None = None, dscp: int = 0) -> None:
        """Send a frame, maybe one that ``carries`` the medium's frame of this number.
        ``report(frame, receivers, verdict, lost)`` is called once for a unicast frame, for a
        broadcast once for each fate, and for each receiver that lacks packets of a train."""
        self._last -= 1
        self._open[self._last] = _Leg(
            report, self._last if carries is None else carries, dscp)
        frame = ports.Frame(self._last, source, receivers, size_bytes, segments, broadcast)
        if self._ledger is not None:
            self._ledger.begin(frame, self._context.now_ns)
        delay_ns = self._model.send(frame)
        if delay_ns is not None:
            self.settle_many(frame, None, ports.Deliver(delay_ns))

    def _judge(self, packet: ports.Frame, receiver: int) -> ports.Drop | None:
        """Rules hear the number of the medium's frame."""
        judge, leg = self._context.judge_transmission, self._open.get(packet.id)
        assert judge is not None
        return judge(packet if leg is None else packet._replace(id=leg.carries), receiver)

    def _dscp(self, frame: ports.Frame) -> int:
        """The mark with which a frame is sent here, or which a frame of the medium has."""
        leg, of = self._open.get(frame.id), self._context.dscp
        if leg is not None:
            return leg.dscp
        return 0 if of is None else of(frame)

    def flow(self, frame: ports.Frame) -> Hashable:
        """The frames that are sent here between the same hosts are one flow."""
        return (self._context.flow(frame) if frame.id > 0
                else ("hop", frame.source, frame.receivers))

    def switched(self, host: int, up: bool) -> None:
        if self.up[host] != up:
            self.up[host] = up
            self._seen = None

    def positions(self, time_ns: int) -> np.ndarray:
        places = self._context.positions(time_ns)
        if places is not self._seen:
            self._seen, self._places = places, places
            if not all(self.up):
                self._places = np.where(np.array(self.up)[:, None], places, np.nan)
                self._places.flags.writeable = False
        return self._places

    def settle(self, frame: ports.Frame, receiver: int, verdict: ports.Deliver | ports.Drop
               ) -> None:
        if frame.id > 0:
            self._context.settle(frame, receiver, verdict)
        else:
            self.settle_many(frame, (receiver,), verdict)

    def settle_many(self, frame: ports.Frame, receivers: Sequence[int] | None,
                    verdict: ports.Deliver | ports.Drop) -> None:
        if frame.id > 0:
            self._context.settle_many(frame, receivers, verdict)
        elif frame.id not in self._open:
            return  # a broadcast that is settled everywhere
        elif frame.broadcast:
            self._settle_broadcast(frame, receivers, verdict)
        else:
            self._settle_unicast(frame, verdict)

    def _settle_unicast(self, frame: ports.Frame, verdict: ports.Deliver | ports.Drop) -> None:
        leg = self._open[frame.id]
        if isinstance(verdict, ports.Drop) and verdict.packets is not None:
            leg.lost |= dict.fromkeys(verdict.packets, verdict.reason)
            if len(leg.lost) < frame.segments:
                return
            verdict = ports.Drop(verdict.reason)
        del self._open[frame.id]
        leg.report(frame, frame.receivers, verdict, leg.lost)
        if self._ledger is not None:
            self._ledger.end(frame)

    def _settle_broadcast(self, frame: ports.Frame, receivers: Sequence[int] | None,
                          verdict: ports.Deliver | ports.Drop) -> None:
        leg = self._open[frame.id]
        lacking = leg.lacking
        if receivers is None:
            receivers = [receiver for receiver in frame.receivers if receiver not in leg.settled]
        if isinstance(verdict, ports.Drop) and verdict.packets is not None:
            for receiver in receivers:
                lacking.setdefault(receiver, {}).update(
                    dict.fromkeys(verdict.packets, verdict.reason))
            receivers = [receiver for receiver in receivers
                         if len(lacking[receiver]) == frame.segments]
        leg.settled.extend(receivers)
        over = len(leg.settled) == len(frame.receivers)
        if over:
            del self._open[frame.id]
        whole = [receiver for receiver in receivers if receiver not in lacking]
        if whole:
            leg.report(frame, whole, verdict, {})
        for receiver in receivers:
            if receiver in lacking:
                leg.report(frame, (receiver,), verdict, lacking[receiver])
        if over and self._ledger is not None:
            self._ledger.end(frame)
