"""One host's end of a connection, from its handshake to its close."""

from __future__ import annotations

from typing import TYPE_CHECKING

from desim.engine.kernel import Phase, pair
from desim.middleware.headers import SEGMENT_HEADER_BYTES
from desim.middleware.jiffies import fires_ns
from desim.middleware.tcp.parameters import SYN_BYTES
from desim.middleware.tcp.receiver import Receiver
from desim.middleware.tcp.sender import Sender
from desim.middleware.tcp.transit import FIN, Token, Train, parts
from desim.middleware.timers import Timer
from desim.network.carrier import Carrier

if TYPE_CHECKING:
    from desim.middleware.tcp.connection import Closed, Connection
    from desim.ports.networks import Handle

# States of an end, by RFC 9293, 3.3.2. A LISTEN one knows nothing of the connection, whether its
# host listens or not; a FIN_WAIT one has been closed by its owner and still sends (FIN-WAIT-1,
# CLOSING, LAST-ACK); the peer has all data and the FIN of a TIME_WAIT one (FIN-WAIT-2, too); a
# CLOSED one answers by resets.
LISTEN, SYN_SENT, SYN_RECEIVED, ESTABLISHED, FIN_WAIT, TIME_WAIT, CLOSED = range(7)

# Segments without data: the kind, when sent, and the time that they echo.
Control = tuple[int, int, int]
SYN, SYN_ACK, ACK, RESET, PROBE, ALIVE = range(6)


class End(Carrier[Control]):
    """One host's end. It is the carrier of its segments without data."""

    protocol = "tcp"
    __slots__ = ("connection", "host", "peer", "state", "closed", "sender", "receiver", "far",
                 "received_ns", "way", "_echo_ns", "_tries", "_timer", "_keeper", "_entity",
                 "_host_id", "_peer_id", "_kernel", "_constants")

    def __init__(self, connection: Connection, host: int, peer: int) -> None:
        tcp = connection.tcp
        ids = tcp.context.host_ids
        self.connection = connection
        self.host, self.peer = host, peer
        self._host_id, self._peer_id = ids[host], ids[peer]
        self._entity = pair(ids[host], ids[peer])
        self.state = LISTEN
        self.way = tcp.way(connection.medium, host, peer)
        self.closed: Closed | None = None
        self.sender = Sender(connection, self, self._entity)
        self.receiver = self.sender.back = Receiver(connection, self, self._entity)
        self.received_ns = self._echo_ns = 0
        self._tries = 0
        self._timer: Handle | None = None
        self._keeper = Timer(tcp.keepers, self._entity, self._keepalive_expired)
        self._kernel = tcp.context.kernel
        self._constants = tcp.constants

    @property
    def conversation(self) -> Connection:
        return self.connection

    def join(self, far: End) -> None:
        """Wire the two ends together."""
        self.far = far
        self.receiver.transit = far.sender.transit
        self.receiver.transit.receiver = self.receiver

    # The handshake.

    def call(self) -> None:
        """The client sends its SYN."""
        self.state = SYN_SENT
        self._send_handshake(SYN)

    def give_up(self, reason: str) -> None:
        """There is no way to the server."""
        self.state = SYN_SENT
        self._timer = self._kernel.after(0, Phase.NETWORK, self._entity, self.fail, reason)

    def _send_handshake(self, what: int) -> None:
        """Send a SYN or SYN-ACK, and again after timeouts that double (for a SYN, after the linear
        ones)."""
        self._send_control(what)
        constants = self._constants
        doubled = max(self._tries - constants.syn_linear, 0) if what == SYN else self._tries
        fires = fires_ns(self._kernel.now_ns, min(constants.first_rto_ns << doubled,
                                                  constants.rto_max_ns), constants.tick_ns)
        self._timer = self._kernel.at(fires, Phase.NETWORK, self._entity, self._unanswered, what)

    def _unanswered(self, what: int) -> None:
        self._timer = None
        self._tries += 1
        constants = self._constants
        if self._tries <= (constants.syn_retries + constants.syn_linear if what == SYN
                           else constants.synack_retries):
            self._send_handshake(what)
        elif what == SYN:
            self.fail("timeout")
        else:
            self.vanish()

    def _establish(self, rtt_ns: int) -> None:
        self.state = ESTABLISHED
        self._stop_timers()
        self.received_ns = self._kernel.now_ns
        if rtt_ns >= 0:
            self.sender.sample(rtt_ns, self.received_ns)
        sender = self.sender
        sender.open = self.receiver.open = True
        if self.connection.keepalive:
            self._set_keepalive(self._constants.keepalive_idle_ns)

    def _stop_timers(self) -> None:
        self._tries = 0
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None
        self._keeper.stop()

    # Segments without data arrive.

    def arrived(self, segment: Control, receiver: int) -> None:
        self.far.take(segment)

    def take(self, segment: Control) -> None:
        """A segment has arrived here."""
        what, sent_ns, echo_ns = segment
        self.received_ns = now_ns = self._kernel.now_ns
        self._echo_ns = sent_ns
        _COMES[what](self, now_ns - echo_ns)

    def unresolved(self, segment: Control) -> None:
        """The segment could not leave: a caller learns that the host is unreachable."""
        if self.state == SYN_SENT:
            self.fail("unreachable")
        elif self.state == SYN_RECEIVED:
            self.vanish()

    def _syn(self, _: int) -> None:
        connection = self.connection
        if self.state == LISTEN and connection.tcp.listening(self.host, connection.service):
            self.state = SYN_RECEIVED
            connection.tcp.hold(self)
            self._send_handshake(SYN_ACK)
        elif self.state == SYN_RECEIVED:
            self._send_control(SYN_ACK)
        elif self.state in (LISTEN, CLOSED):
            self._send_control(RESET)

    def _syn_ack(self, rtt_ns: int) -> None:
        if self.state == SYN_SENT:
            self._establish(rtt_ns)
            self._send_control(ACK)
            self.connection.open = True
            self.sender.push()
            self.connection.tcp.opened(self.connection)
        elif self.state in (ESTABLISHED, FIN_WAIT, TIME_WAIT):
            self._send_control(ACK)
        else:
            self._send_control(RESET)

    def _ack(self, rtt_ns: int) -> None:
        if self.state == SYN_RECEIVED:
            self._establish(rtt_ns)
            self.connection.tcp.accepted(self.connection)
        elif self.state in (LISTEN, CLOSED):
            self._send_control(RESET)

    def _reset(self, _: int) -> None:
        if self.state == SYN_SENT:
            self.fail("refused")
        elif self.state == ESTABLISHED:
            self.fail("reset")
        else:
            self.vanish()

    def _probe(self, _: int) -> None:
        self._send_control(ALIVE if self.state in (ESTABLISHED, FIN_WAIT, TIME_WAIT) else RESET)

    def _alive(self, _: int) -> None:
        """A keepalive answer: only the time of its arrival matters."""

    def stray(self, half: Sender | Receiver, token: Token) -> None:
        """Data or an acknowledgement has arrived at a half that is not open."""
        if self.state == SYN_RECEIVED:
            self._ack(-1)  # the ACK was lost, and with it the measurement
            if self.state == ESTABLISHED:
                half.arrived(token, self.host)
        elif self.state in (LISTEN, CLOSED):
            self._send_control(RESET)
        elif self.state in (FIN_WAIT, TIME_WAIT) and half is self.receiver:
            self._late(token)

    def _late(self, train: Train) -> None:
        """Data after this end was closed: the peer's FIN is acknowledged, its data refused."""
        start, end, ack, sent_ns, echo_ns, fin, _ = train
        if ack > self.sender.snd_una:
            self.sender.acked(ack, echo_ns)
        receiver = self.receiver
        rcv_nxt = receiver.rcv_nxt
        if end > rcv_nxt and (start > rcv_nxt or not fin or rcv_nxt < end - 1):
            self._send_control(RESET)
            self.vanish()
            return
        if end > rcv_nxt:
            receiver.rcv_nxt = end
            receiver.transit.delivered += 1
        receiver.ts_recent_ns = sent_ns
        receiver.acknowledge(1)

    # The close.

    def close(self) -> None:
        if self.state == SYN_SENT:
            self.vanish()
        elif self.state == ESTABLISHED:
            self.state = FIN_WAIT
            self.connection.open = False
            self._stop_timers()
            self.receiver.shut()
            self.sender.finish(self.far.finishes)

    def finishes(self, _: object) -> None:
        """The peer's FIN has arrived, after all its data."""
        if self.state == ESTABLISHED:
            self.connection.open = False
            self._notify_owner("fin")

    def finished(self) -> None:
        """All that this end sent has arrived at the peer, its FIN too."""
        self.state = TIME_WAIT
        self.connection.tcp.release(self)

    def fail(self, reason: str) -> None:
        """End the connection here, and notify the owner."""
        owned = self.state in (SYN_SENT, ESTABLISHED)
        self.state = CLOSED
        self.connection.open = False
        self._stop_timers()
        self.sender.open = False
        self.receiver.shut()
        if owned:
            self._notify_owner(reason)
        self.vanish()

    def vanish(self) -> None:
        """End without a segment; the server's end of an unfinished handshake is as if it never was.
        """
        self.state = LISTEN if self.state in (LISTEN, SYN_RECEIVED) else CLOSED
        self._stop_timers()
        self.sender.shut()
        self.receiver.shut()
        if self.far.state != ESTABLISHED:
            self.connection.open = False
        self.connection.tcp.release(self)

    def record_frame(self, message: Token, kind: str | None, size_bytes: int) -> None:
        """Record that so many bytes of a message leave: a frame of data, or bytes of discovery."""
        connection = self.connection
        context = connection.tcp.context
        if kind is None:
            message.last_ns = now_ns = self._kernel.now_ns
            if message.first_ns < 0:
                message.first_ns = now_ns
            context.record_frame(self._host_id, self._peer_id, message.seq, size_bytes)
        else:
            context.record_control(connection.kind if kind is FIN else kind, self.host,
                                   self._peer_id, size_bytes)

    def lost_train(self, start: int, end: int, reason: str) -> None:
        """Record that the medium lost a train of this end, which does not know: a row for each of
        its messages of data."""
        context, sender = self.connection.tcp.context, self.sender
        for message, kind, _ in parts(sender.transit.messages, sender.snd_una, start, end):
            if kind is None:
                context.record_loss(self.host, self.peer, message.seq, reason)

    def last_data_ns(self) -> int:
        """The time of the last arrival of data at this end."""
        return self.receiver.received_ns

    def _notify_owner(self, reason: str) -> None:
        closed, self.closed = self.closed, None
        if closed is not None:
            closed(self.connection, reason)

    # Keepalive.

    def _set_keepalive(self, delay_ns: int) -> None:
        self._keeper.expect(fires_ns(self._kernel.now_ns, delay_ns, self._constants.tick_ns))

    def _keepalive_expired(self) -> None:
        """Probe a peer that was silent for so long; data under way has its own timer."""
        constants, sender = self._constants, self.sender
        idle_ns = self._kernel.now_ns - max(self.received_ns, sender.received_ns,
                                            self.last_data_ns())
        left_ns = constants.keepalive_idle_ns - (0 if sender.pending else idle_ns)
        if left_ns > 0:
            self._tries = 0
            self._set_keepalive(left_ns)
        elif self._tries < constants.keepalive_probes:
            self._tries += 1
            self._send_control(PROBE)
            self._set_keepalive(constants.keepalive_interval_ns)
        else:
            self._send_control(RESET)
            self.fail("timeout")

    def _send_control(self, what: int) -> None:
        """Send a segment without data."""
        connection = self.connection
        size_bytes = SYN_BYTES if what in (SYN, SYN_ACK) else SEGMENT_HEADER_BYTES
        connection.tcp.context.record_control(connection.kind, self.host, self._peer_id, size_bytes)
        self.way.transmit(self.host, (self.peer,), size_bytes, 1, False, self,
                          (what, self._kernel.now_ns, self._echo_ns))


_COMES = {SYN: End._syn, SYN_ACK: End._syn_ack, ACK: End._ack, RESET: End._reset,
          PROBE: End._probe, ALIVE: End._alive}
