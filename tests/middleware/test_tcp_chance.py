"""TCP in all sorts of trouble: what arrives does so once and in order; all ends come to rest."""

from graphs import MS, S
from hypothesis import example, given
from hypothesis import strategies as st
from tcphosts import Pair, Word, link

from desim.ports import Drop
from netmodels.rules.duplication import Duplication
from netmodels.rules.loss import Loss
from netmodels.rules.reordering import Reordering

GAPS_NS = st.one_of(st.integers(0, 10 * MS), st.integers(0, 5 * S))


@given(st.floats(0, 0.2), st.floats(0, 0.3), st.floats(0, 0.3), st.integers(1, 100), st.booleans(),
       st.sampled_from(["sent", "implied"]), st.sampled_from(["3 ms", "3 us"]), st.integers(0, 9),
       st.lists(st.tuples(GAPS_NS, st.integers(0, 1), st.integers(1, 60_000)), max_size=20))
def test_each_message_arrives_once_and_in_order(lost, twice, late, late_ms, nodelay, acks, latency,
                                                seed, says):
    pair = Pair(link(rate="20 Mb/s", latency=latency),
                [Loss(Loss.Params(probability=lost)),
                 Duplication(Duplication.Params(probability=twice)),
                 Reordering(Reordering.Params(probability=late, delay=f"{late_ms} ms"))], seed=seed,
                params={"acks": acks, "near": "1 ms"})
    pair.call(nodelay=nodelay)
    time_ns = 100 * S
    for seq, (gap_ns, source, size_bytes) in enumerate(says):
        time_ns += gap_ns
        pair.at(time_ns, pair.say, seq, size_bytes, source)
    pair.run(time_ns + 2000 * S)
    heard = [seq for _, seq in pair.heard()]
    for source in 0, 1:
        expected = [seq for seq, say in enumerate(says) if say[1] == source]
        assert [seq for seq in heard if says[seq][1] == source] == expected
        assert not pair.connection.unacked(source)


class Cut:
    """A rule that loses all, while it is ``on``."""

    reasons = ("cut",)
    on = False

    def start(self, context, hosts):
        pass

    def judge(self, frame, receivers):
        return [Drop("cut")] * len(receivers) if self.on else None


class Walk(Pair):
    """Users who close what their peers closed, and account for each message: it is heard, or given
    up by a sender who closes, stops or learns that the connection is over."""

    def __init__(self):
        self.cut = Cut()
        super().__init__(link(rate="1 Mb/s", latency="5 ms"), [self.cut])
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

    def call(self):
        if self.net.graph.up[0]:
            self.calls.append(self.tcp.connect(0, 1, "talk", "talk", opened=lambda _: None,
                                               closed=self._over(0)))

    def say(self, source, size_bytes):
        if not self.calls or not self.connection.holds(source):
            return
        connection, seq = self.connection, len(self.fates)
        self.fates[seq] = None
        said = self.said.setdefault((connection, source), [])
        said.append(seq)

        def arrived(word):
            assert word.seq == said.pop(0), "in order, and none twice"
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

    def set_cut(self, on):
        self.cut.on = on


HOST = st.integers(0, 1)
DEEDS = st.one_of(
    st.tuples(st.just("call")), st.tuples(st.just("say"), HOST, st.integers(1, 20_000)),
    st.tuples(st.just("close"), HOST), st.tuples(st.just("stop"), HOST),
    st.tuples(st.just("start"), HOST), st.tuples(st.just("set_cut"), st.booleans()))
TIMES_NS = st.one_of(st.integers(0, 20 * MS), st.integers(0, 3 * S), st.integers(0, 300 * S))


@given(st.lists(st.tuples(TIMES_NS, DEEDS), max_size=40))
@example([(0, ("call",)), (S, ("say", 0, 5000)), (1, ("say", 1, 5000)), (0, ("close", 1)),
          (S, ("call",)), (S, ("set_cut", True)), (S, ("say", 0, 100)), (S, ("close", 1)),
          (S, ("stop", 1)), (S, ("start", 1)), (S, ("set_cut", False))])
def test_a_walk_through_outages_restarts_and_closing(deeds):
    walk = Walk()
    time_ns = 0
    for gap_ns, (deed, *args) in [(0, ("call",)), *deeds]:
        time_ns += gap_ns
        walk.at(time_ns, getattr(walk, deed), *args)
    walk.at(time_ns + 1, walk.set_cut, False)
    for host in 0, 1:
        walk.at(time_ns + 1, walk.start, host)
    walk.run(time_ns + 3000 * S)
    waiting = [walk.fates[word.seq] for connection in walk.calls for host in (0, 1)
               for word in connection.unheard(host)]
    assert not waiting, "3000 s later everything is heard or given up"
    for connection in walk.calls:
        assert connection.holds(0) == connection.holds(1) == connection.open
    for _, seqs in walk.said.items():
        assert all(walk.fates[seq] != "heard" for seq in seqs)
    assert None not in walk.fates.values()
