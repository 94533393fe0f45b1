"""Two hosts with a TCP between them, whose users do all that they may."""

from __future__ import annotations

from graphs import MS, S
from hypothesis import strategies as st
from tcp_hosts import Pair, Word

from desim.ports import Deliver, Drop, Duplicate


class Trouble:
    """A rule that loses what the ``mute`` hosts send. Of all other frames every n-th is lost,
    copied after so many ns, or later by so many (n = 0: none is)."""

    reasons = ("cut",)

    def __init__(self):
        self._count = 0
        self.calm()

    def calm(self):
        self.mute, self.lost, self.copied, self.late = (), 0, (0, 0), (0, 0)

    def start(self, context, hosts):
        pass

    def judge(self, frame, receivers):
        self._count += 1
        if frame.source in self.mute or self._is(self.lost):
            verdict = Drop("cut")
        elif self._is(self.copied[0]):
            verdict = Duplicate(self.copied[1])
        elif self._is(self.late[0]):
            verdict = Deliver(self.late[1])
        else:
            return None
        return [verdict] * len(receivers)

    def _is(self, every):
        return every and self._count % every == 0


class Walk(Pair):
    """Users who close what their peers closed, and account for each message: it is heard, or given
    up by a sender who closes, stops or learns that the connection is over."""

    def __init__(self, model, **options):
        self.trouble = Trouble()
        super().__init__(model, [self.trouble], **options)
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
        for word in connection.undelivered(source):
            self._fate(word, fate)

    def _fate(self, word, fate):
        assert self.fates[word.seq] is None
        self.fates[word.seq] = fate

    def call(self, nodelay=False):
        if self.net.graph.up[0]:
            self.calls.append(self.tcp.connect(0, 1, "talk", "talk", opened=lambda _: None,
                                               closed=self._over(0), nodelay=nodelay))

    def say(self, source, *sizes):
        """A message; who hears it answers with the next one."""
        if self.calls and self.connection.holds(source):
            self._say(self.connection, source, sizes, False)

    def say_last(self, source, size_bytes):
        """The end that hears it closes."""
        if self.calls and self.connection.holds(source):
            self._say(self.connection, source, [size_bytes], True)

    def say_often(self, source, times, size_bytes):
        for _ in range(times):
            self.say(source, size_bytes)

    def _say(self, connection, source, sizes, last):
        seq = len(self.fates)
        self.fates[seq] = None
        said = self.said.setdefault((connection, source), [])
        said.append(seq)

        def arrived(word):
            assert word.seq == said.pop(0), "in order, and none twice"
            self.note("heard", word.seq)
            if self.fates[word.seq] != "closed":
                self._fate(word, "heard")
            if sizes[1:] and connection.holds(1 - source):
                self._say(connection, 1 - source, sizes[1:], False)
            if last and connection is self.connection:
                self.close(1 - source)
        connection.send(source, sizes[0], arrived, Word(seq))

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

    def note_ends(self):
        """Note what each end knows of what it has said."""
        for connection in self.calls:
            for host in 0, 1:
                self.note("waits", host, connection.sender(host).writable, *(
                    [word.seq for word in words]
                    for words in (connection.unacked(host), connection.undelivered(host))))

    def wait(self, host):
        """For room in the socket."""
        if self.calls and self.connection.holds(host):
            self.connection.sender(host).when_writable(lambda: self.note("room", host))

    def disturb(self, how, what):
        setattr(self.trouble, how, what)

    def mend_at(self, time_ns):
        """From then on all is well."""
        self.at(time_ns, self.trouble.calm)
        for host in 0, 1:
            self.at(time_ns, self.start, host)

    def check(self):
        """All is over."""
        assert not any(connection.undelivered(host) for connection in self.calls
                       for host in (0, 1)), "everything is heard or given up"
        for connection in self.calls:
            assert connection.holds(0) == connection.holds(1) == connection.open
        for seqs in self.said.values():
            assert all(self.fates[seq] != "heard" for seq in seqs)
        assert None not in self.fates.values()


HOST = st.integers(0, 1)
SIZE = st.one_of(st.integers(1, 20_000), st.sampled_from([100, 800, 1448, 1449, 60_000]))
EVERY = st.sampled_from([0, 1, 3])
DELAYS_NS = st.sampled_from([1000, MS, 100 * MS, 150 * MS, 250 * MS, 5 * S])
TROUBLE = st.one_of(
    st.tuples(st.just("mute"), st.sampled_from([(), (0,), (1,), (0, 1)])),
    st.tuples(st.just("lost"), st.sampled_from([0, 2, 5, 20])),
    st.tuples(st.sampled_from(["copied", "late"]), st.tuples(EVERY, DELAYS_NS)))
DEEDS = st.one_of(
    st.tuples(st.just("call")), st.tuples(st.just("say"), HOST, SIZE),
    st.tuples(st.just("say"), HOST, SIZE, SIZE), st.tuples(st.just("say"), HOST, *[SIZE] * 5),
    st.tuples(st.just("say_often"), HOST, st.integers(2, 12), SIZE),
    st.tuples(st.just("say_last"), HOST, SIZE), st.tuples(st.just("close"), HOST),
    st.tuples(st.just("stop"), HOST), st.tuples(st.just("start"), HOST),
    st.tuples(st.just("disturb"), TROUBLE).map(lambda deed: (deed[0], *deed[1])))
