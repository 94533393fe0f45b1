"""TCP in all sorts of trouble: what arrives does so once and in order; all ends come to rest."""

from graphs import MS, S
from hypothesis import example, given
from hypothesis import strategies as st
from tcp_hosts import Pair, link
from tcp_walk import DEEDS, Walk

from netmodels.rules.loss import Loss
from netmodels.rules.timing import Duplication, Reordering

GAPS_NS = st.one_of(st.integers(0, 10 * MS), st.integers(0, 5 * S))


@given(st.floats(0, 0.2), st.floats(0, 0.3), st.floats(0, 0.3), st.integers(1, 100), st.booleans(),
       st.sampled_from(["3 ms", "3 us"]), st.integers(0, 9),
       st.lists(st.tuples(GAPS_NS, st.integers(0, 1), st.integers(1, 60_000)), max_size=20))
def test_each_message_arrives_once_and_in_order(lost, twice, late, late_ms, nodelay, latency,
                                                seed, says):
    pair = Pair(link(rate="20 Mb/s", latency=latency),
                [Loss(Loss.Params(probability=lost)),
                 Duplication(Duplication.Params(probability=twice)),
                 Reordering(Reordering.Params(probability=late, delay=f"{late_ms} ms"))], seed=seed,
                params={"near": "1 ms"})
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


REFUSED = [(S, ("say_often", 0, 2, 100)), (0, ("say_last", 0, 100)), (0, ("say_often", 0, 2, 100))]
TIMES_NS = st.one_of(st.integers(0, 20 * MS), st.integers(0, 3 * S), st.integers(0, 300 * S))


@given(st.lists(st.tuples(TIMES_NS, DEEDS), max_size=40))
@example(REFUSED)
@example([(0, ("call",)), (S, ("say", 0, 5000)), (1, ("say", 1, 5000)), (0, ("close", 1)),
          (S, ("call",)), (S, ("disturb", "mute", (0, 1))), (S, ("say", 0, 100)), (S, ("close", 1)),
          (S, ("stop", 1)), (S, ("start", 1)), (S, ("disturb", "mute", ()))])
def test_a_walk_through_outages_restarts_and_closing(deeds):
    walk = Walk(link(rate="1 Mb/s", latency="5 ms"), params={"near": "20 ms"})
    time_ns = 0
    for gap_ns, (deed, *args) in [(0, ("call",)), *deeds]:
        time_ns += gap_ns
        walk.at(time_ns, getattr(walk, deed), *args)
    walk.mend_at(time_ns + 1)
    walk.run(time_ns + 3000 * S)
    walk.check()
