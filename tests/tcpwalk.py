"""Two hosts with a TCP between them, whose users do all that they may."""

from __future__ import annotations

from hypothesis import strategies as st
from tcphosts import Pair, Word

from desim.ports import Deliver, Drop


class Cut:
    """A rule that loses all, while it is ``on``."""

    reasons = ("cut",)
    on = False

    def start(self, context, hosts):
        pass

    def judge(self, frame, receivers):
        return [Drop("cut")] * len(receivers) if self.on else None


class Slow:
    """A rule that delays all by ``delay_ns``, if that is above 0."""

    reasons = ()
    delay_ns = 0

    def start(self, context, hosts):
        pass

    def judge(self, frame, receivers):
        return [Deliver(self.delay_ns)] * len(receivers) if self.delay_ns else None


class Walk(Pair):
    """Users who close what their peers closed, and account for each message: it is heard, or given
    up by a sender who closes, stops or learns that the connection is over."""

    def __init__(self, model, **options):
        self.cut, self.slow = Cut(), Slow()
        super().__init__(model, [self.cut, self.slow], **options)
        self.said = {}  # (connection, source): sequence numbers
        self.fates = {}  # of each number

    def _accept(self, connection):
        connection.on_closed(1, self._over(1))

    def _over(self, host):
        def over(connection, reason):
            self._give_up(connection, host)
            connection.close(host)
        return over

    def _give_up(self, connection, source, fate="dropped"):
        for word in connection.unheard(source):
            self._fate(word, fate)

    def _fate(self, word, fate):
        assert self.fates[word.seq] is None
        self.fates[word.seq] = fate

    def call(self, nodelay=False):
        if self.net.graph.up[0]:
            self.calls.append(self.tcp.connect(0, 1, "talk", "talk", opened=lambda _: None,
                                               closed=self._over(0), nodelay=nodelay))

    def say(self, source, size_bytes):
        if not self.calls or not self.connection.holds(source):
            return
        connection, seq = self.connection, len(self.fates)
        self.fates[seq] = None
        said = self.said.setdefault((connection, source), [])
        said.append(seq)

        def arrived(word):
            assert word.seq == said.pop(0), "in order, and none twice"
            self.note("heard", word.seq)
            if self.fates[word.seq] != "closed":
                self._fate(word, "heard")
        connection.send(source, size_bytes, arrived, Word(seq))

    def close(self, host):
        if self.calls and self.connection.holds(host):
            self._give_up(self.connection, host, "closed")
            super().close(host)

    def stop(self, host):
        if self.net.graph.up[host]:
            for connection in self.calls:
                if connection.holds(host):
                    self._give_up(connection, host)
            super().stop(host)

    def start(self, host):
        if not self.net.graph.up[host]:
            super().start(host)
            self.tcp.listen(1, "talk", self._accept)

    def look(self):
        """What each end knows of what it has said."""
        for connection in self.calls:
            for host in 0, 1:
                self.note("waits", host, connection.sender(host).room, *(
                    [word.seq for word in words]
                    for words in (connection.unacked(host), connection.unheard(host))))

    def wait(self, host):
        """For room in the socket."""
        if self.calls and self.connection.holds(host):
            self.connection.sender(host).when_room(lambda: self.note("room", host))

    def set_cut(self, on):
        self.cut.on = on

    def set_slow(self, delay_ns):
        self.slow.delay_ns = delay_ns

    def mend_at(self, time_ns):
        """From then on all is well."""
        self.at(time_ns, self.set_cut, False).at(time_ns, self.set_slow, 0)
        for host in 0, 1:
            self.at(time_ns, self.start, host)

    def check(self):
        """All is over."""
        assert not any(connection.unheard(host) for connection in self.calls for host in (0, 1)), \
            "everything is heard or given up"
        for connection in self.calls:
            assert connection.holds(0) == connection.holds(1) == connection.open
        for seqs in self.said.values():
            assert all(self.fates[seq] != "heard" for seq in seqs)
        assert None not in self.fates.values()


HOST = st.integers(0, 1)
DEEDS = st.one_of(
    st.tuples(st.just("call")), st.tuples(st.just("say"), HOST, st.integers(1, 20_000)),
    st.tuples(st.just("close"), HOST), st.tuples(st.just("stop"), HOST),
    st.tuples(st.just("start"), HOST), st.tuples(st.just("set_cut"), st.booleans()))
