"""Epidemic routing: hosts store messages, carry them, and pass copies on to those they meet."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

from pydantic import Field

from desim import ports
from desim.units import ByteSize, Period
from netmodels.hops import HopLedger, HopPart
from netmodels.multihop.hop_choice import HOPS, HopChoice
from netmodels.multihop.on_hops import OnHops

_ARRIVED, _EXPIRED = ports.Deliver(0), ports.Drop("expired")
_FULL, _DOWN = ports.Drop("buffer_full"), ports.Drop("relay_down")
_TOO_LARGE = ports.Drop("too_large")
_PACKET_BYTES = 1518  # of packets that a longer summary is cut into (IEEE 802.3)


# When a host got its copy of a message, and the parts of the time until then.
CarriedTimes = tuple[int, list[HopPart]]


class _Bundle:
    """A unicast frame that hosts carry: ``copies`` are held or on the air. ``lost``: the reason why
    the last holder gave one up."""

    def __init__(self, frame: ports.Frame, dies_ns: int) -> None:
        self.frame, self.dies_ns = frame, dies_ns
        self.copies, self.settled, self.lost = 0, False, _FULL
        self.paths: dict[int, CarriedTimes] = {}  # by host that had it, where there is a ledger


class _Store:
    """The messages that one host holds, the oldest first; the numbers of all that it has had, and
    until when it waits for those that it has asked for."""

    def __init__(self) -> None:
        self.announcing = False  # whether a summary is booked
        self.forget()

    def forget(self) -> None:
        """Lose everything: the host has stopped."""
        self.held: dict[int, _Bundle] = {}
        self.size_bytes = 0
        self.had: set[int] = set()
        self.asked: dict[int, int] = {}

    def drop(self, number: int) -> None:
        self.size_bytes -= self.held.pop(number).frame.size_bytes


class Epidemic(OnHops):
    """Store, carry and forward (Vahdat and Becker 2000, "Epidemic routing for partially-connected
    ad hoc networks"): a host keeps copies of its own messages and of others', and a host that
    meets it gets those that it has not had. So messages spread until they are ``lifetime`` old,
    whether they have arrived or not.

    A host that holds something broadcasts a summary of it every ``interval``, the first one at a
    random time of it; a host that hears it asks for the messages that it has not had, and is sent
    them, those for itself first. All three are frames of the ``hop`` model. A message that a host
    has had is not asked for again, and one that was asked for not within ``patience``. A full
    buffer gives up its oldest message.

    A message is lost when it is ``lifetime`` old (``expired``), or when the last host that holds it
    gives it up (``buffer_full``) or stops (``relay_down``); one that no buffer holds is not taken
    (``too_large``). A copy that lacks a packet is none, and asked for again. A broadcast goes one
    hop. Left out: the limit of hops, and messages that clean up behind one that has arrived. A
    stream on top repeats what is late; datagrams are what this is for.

    Capabilities: Refuses, FollowsHosts, CountsControl, Itemizes, KnowsDepartures; if its hop has
    them, CountsBusyTime, CountsAirtime, Retransmits.
    """

    class Params(HopChoice):
        interval_ns: Period = Field("1 s", description="between a host's summaries (as batman's "
                                                       "messages)")
        patience_ns: Period = Field("5 s", description="from asking for a message to asking again "
                                                       "(a 100 kB message at 1 Mb/s, six times)")
        lifetime_ns: Period = Field("300 s", description="of a message (a few minutes' way of a "
                                                         "robot)")
        buffer_bytes: ByteSize = Field("10 MB", ge=1, description=(
            "of a host, for all messages with their headers (a hundred of 100 kB)"))
        header_bytes: ByteSize = Field("46 B", ge=1, description="of a summary or a request "
                                                                 "(Ethernet, IP, UDP)")
        number_bytes: ByteSize = Field("4 B", ge=1, description=(
            "of each message named in it (Vahdat and Becker: 32 bits)"))

    reasons = tuple(sorted({"buffer_full", "expired", "relay_down", "too_large"}.union(
        *(model.reasons for model in HOPS.values()))))
    refuses = tuple(sorted({"too_large"}.union(*(getattr(model, "refuses", ())
                                                 for model in HOPS.values()))))

    def __init__(self, params: Params, hop: ports.NetworkModel | None = None) -> None:
        """``hop``: see ``OnHops``."""
        super().__init__(params, hop)
        self._params, self._frames, self._bytes = params, 0, 0

    def start(self, context: ports.Context, hosts: tuple[str, ...]) -> None:
        super().start(context, hosts)
        self._stores = [_Store() for _ in hosts]
        self._draws = [context.stream("epidemic", host).random for host in hosts]

    def send(self, frame: ports.Frame) -> int | None:
        if frame.broadcast:
            return self._hop.send(frame)
        if frame.size_bytes > self._params.buffer_bytes:
            self._context.settle(frame, frame.receivers[0], _TOO_LARGE)
            return None
        message = _Bundle(frame, self._context.now_ns + self._params.lifetime_ns)
        if self._ledger is not None:
            message.paths[frame.source] = self._context.now_ns, []
        self._context.at(message.dies_ns, self._expire, message)
        self._keep(frame.source, message)
        return None

    def departure_ns(self, host: int) -> int:
        """``ports.KnowsDepartures``: what a host stores has left the socket it came from."""
        return 0

    def switched(self, host: int, up: bool) -> None:
        """A host has started or stopped: the messages that it held are lost."""
        self._hops.switched(host, up)
        if not up:
            held = list(self._stores[host].held.values())
            self._stores[host].forget()
            for message in held:
                self._give_up(message, _DOWN)

    def control(self) -> tuple[int, int]:
        """Frames and bytes of summaries and requests that were sent so far."""
        return self._frames, self._bytes

    # Messages at a host.

    def _keep(self, host: int, message: _Bundle) -> None:
        store, frame, most_bytes = self._stores[host], message.frame, self._params.buffer_bytes
        store.had.add(frame.id)
        message.copies += 1
        while store.size_bytes + frame.size_bytes > most_bytes:
            number, oldest = next(iter(store.held.items()))
            store.drop(number)
            self._give_up(oldest, _FULL)
        store.held[frame.id] = message
        store.size_bytes += frame.size_bytes
        if not store.announcing:
            store.announcing = True
            wait_ns = int(self._draws[host]() * self._params.interval_ns)
            self._context.at(self._context.now_ns + wait_ns, self._announce, host)

    def _give_up(self, message: _Bundle, why: ports.Drop) -> None:
        message.copies -= 1
        message.lost = why
        self._settle_if_gone(message)

    def _settle_if_gone(self, message: _Bundle) -> None:
        if not message.copies:
            self._settle(message, message.lost)

    def _settle(self, message: _Bundle, verdict: ports.Deliver | ports.Drop) -> None:
        if not message.settled:
            message.settled = True
            self._context.settle(message.frame, message.frame.receivers[0], verdict)

    def _expire(self, message: _Bundle) -> None:
        number = message.frame.id
        for store in self._stores:
            if number in store.held:
                store.drop(number)
            store.had.discard(number)
            store.asked.pop(number, None)
        self._settle(message, _EXPIRED)

    # Summaries and requests.

    def _announce(self, host: int) -> None:
        store = self._stores[host]
        if not store.held:
            store.announcing = False
            return
        self._context.at(self._context.now_ns + self._params.interval_ns, self._announce, host)
        self._control(host, self._hops.others[host], tuple(store.held), broadcast=True)

    def _control(self, host: int, receivers: tuple[int, ...], numbers: Sequence[int], *,
                 broadcast: bool) -> None:
        params = self._params
        size_bytes = params.header_bytes + params.number_bytes * len(numbers)
        self._frames += 1
        self._bytes += size_bytes
        self._hops.send(host, receivers, size_bytes, -(-size_bytes // _PACKET_BYTES), broadcast,
                        partial(self._control_settled, numbers))

    def _control_settled(self, numbers: Sequence[int], frame: ports.Frame,
                         receivers: Sequence[int], verdict: ports.Deliver | ports.Drop,
                         lost: dict[int, str]) -> None:
        if isinstance(verdict, ports.Drop) and verdict.reason in self._hops.refuses:
            self._frames -= 1
            self._bytes -= frame.size_bytes
        elif isinstance(verdict, ports.Deliver) and not lost:
            heard = self._heard if frame.broadcast else self._asked
            self._context.at(self._context.now_ns + verdict.delay_ns, heard,
                             (frame.source, receivers, numbers))

    def _heard(self, heard: tuple[int, Sequence[int], Sequence[int]]) -> None:
        """A summary arrives: its receivers ask for what they have not had."""
        holder, receivers, numbers = heard
        now_ns = self._context.now_ns
        for host in receivers:
            store = self._stores[host]
            wanted = [number for number in numbers
                      if number not in store.had and store.asked.get(number, 0) <= now_ns]
            if wanted and self._hops.up[host]:
                store.asked.update(dict.fromkeys(wanted, now_ns + self._params.patience_ns))
                self._control(host, (holder,), wanted, broadcast=False)

    def _asked(self, asked: tuple[int, Sequence[int], Sequence[int]]) -> None:
        """A request arrives: its receiver sends the messages that it still holds."""
        host, (holder,), numbers = asked
        held = self._stores[holder].held
        given = [held[number] for number in numbers if number in held]
        for message in sorted(given, key=lambda message: message.frame.receivers[0] != host):
            message.copies += 1
            frame = message.frame
            self._hops.send(holder, (host,), frame.size_bytes, frame.segments, False,
                            partial(self._copy_settled, message))

    def _copy_settled(self, message: _Bundle, leg: ports.Frame, _: Sequence[int],
                      verdict: ports.Deliver | ports.Drop, lost: dict[int, str]) -> None:
        if isinstance(verdict, ports.Deliver) and not lost:
            arrives_ns = self._context.now_ns + verdict.delay_ns
            path = None
            if self._ledger is not None:
                path = arrives_ns, self._path(self._ledger, message, leg, arrives_ns)
            self._context.at(arrives_ns, self._got, (message, leg.receivers[0], path))
        else:
            message.copies -= 1
            self._settle_if_gone(message)

    def _path(self, ledger: HopLedger, message: _Bundle, leg: ports.Frame, arrives_ns: int
              ) -> list[HopPart]:
        """The parts of the time of a copy that has made the hop ``leg``."""
        since_ns, before = message.paths[leg.source]
        carried_ns = ledger.begun_ns(leg) - since_ns
        return [*before, (ports.TimePart.QUEUE, carried_ns, leg.source),
                *ledger.parts(leg, arrives_ns)]

    def _got(self, got: tuple[_Bundle, int, CarriedTimes | None]) -> None:
        message, host, path = got
        store, number = self._stores[host], message.frame.id
        store.asked.pop(number, None)
        message.copies -= 1
        if self._context.now_ns >= message.dies_ns:
            return
        if self._hops.up[host] and number not in store.had:
            if path is not None and self._ledger is not None:
                message.paths[host] = path
                if host == message.frame.receivers[0]:
                    self._ledger.pass_on(message.frame, path[1])
            if host == message.frame.receivers[0]:
                store.had.add(number)
                self._settle(message, _ARRIVED)
            else:
                self._keep(host, message)
        self._settle_if_gone(message)
