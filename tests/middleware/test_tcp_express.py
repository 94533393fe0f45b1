"""Messages by express: the same rows, for less."""

from unittest.mock import patch

import pytest
from graphs import MS, S
from hypothesis import example, given
from hypothesis import strategies as st
from tcphosts import Pair, Word, link
from tcpwalk import DEEDS, Walk

from desim.middleware.tcp.express import Express
from desim.middleware.tcp.receiver import Receiver
from desim.ports import Deliver
from netmodels.link import Link

IMPLIED = {"acks": "implied"}


def wire():
    """1 us a kilobit, 3 us to the other side: near, as TCP sees it."""
    return link(rate="1 Gb/s", latency="3 us")


class Taciturn(Link):
    """It settles what it is sent by itself, and does not say when it will be there."""

    def start(self, context, hosts):
        super().start(context, hosts)
        self._settle = context.settle

    def send(self, frame):
        delay_ns = super().send(frame)
        if delay_ns is not None:
            self._settle(frame, frame.receivers[0], Deliver(delay_ns))


def taciturn():
    return Taciturn(Link.Params(rate="1 Gb/s", latency="3 us"))


def outcome(walk):
    medium = walk.net.medium
    context = walk.net.graph.context
    return (walk.log, walk.rows(), walk.fates, medium.frames, medium.delivered, medium.dropped,
            medium.tx_bytes, medium.rx_bytes, context.discovery_bytes, context.discovery_frames,
            walk.at_rest())


def walked(model, deeds, nodelay, params=IMPLIED):
    walk = Walk(model, params=params)
    time_ns = 0
    for gap_ns, (deed, *args) in deeds:
        time_ns += gap_ns
        walk.at(time_ns, getattr(walk, deed), *([nodelay] if deed == "call" else args))
    walk.mend_at(time_ns + 1)
    walk.run(time_ns + 3000 * S)
    walk.check()
    return outcome(walk)


def through_the_stream(express, *_):
    """Stands in for ``Express.send``: never by express."""
    return False


def the_same(deeds, *, nodelay, model=wire):
    """Their outcome, which is the same through the stream."""
    outcome = walked(model(), deeds, nodelay)
    with patch.object(Express, "send", through_the_stream):
        assert walked(model(), deeds, nodelay) == outcome
    return outcome


GAPS_NS = st.one_of(st.integers(0, 40_000), st.sampled_from([0, MS, 150 * MS, 250 * MS]),
                    st.integers(0, 100 * S))
MORE_DEEDS = st.one_of(
    DEEDS, st.tuples(st.just("say"), st.integers(0, 1), st.sampled_from([1, 800, 1448, 400_000])),
    st.tuples(st.just("set_slow"), st.sampled_from([0, 150 * MS, 250 * MS])),
    st.tuples(st.just("look")), st.tuples(st.just("wait"), st.integers(0, 1)))
SAY, LARGE = ("say", 0, 800), ("say", 0, 60_000)


@example([(S, SAY), (S, SAY), (2000, ("close", 1))], False, wire)  # while it is on its way
@example([(S, SAY), (S, SAY), (2000, ("stop", 0))], False, wire)
@example([(S, SAY), (S, SAY), (2000, ("close", 0)), (S, ("look",))], False, wire)
@example([(S, SAY), (S, LARGE), (9000, ("look",))], False, wire)
@example([(S, SAY), (S, LARGE), (9000, ("wait", 0))], False, wire)
@example([(S, SAY), (S, ("set_slow", 150 * MS)), (0, SAY), (120 * MS, ("set_slow", 250 * MS)),
          (0, SAY), (S, ("set_slow", 0))], True, wire)  # a timeout after the first has come
@example([(S, SAY), (S, ("say", 0, 400_000))], False, wire)
@example([(S, SAY), (S, ("set_cut", True)), (0, SAY), (S, ("set_cut", False)), (S, SAY),
          (S, ("say", 0, 200_000))], False, wire)
@given(st.lists(st.tuples(GAPS_NS, MORE_DEEDS), max_size=40), st.booleans(),
       st.sampled_from([wire, taciturn]))
def test_by_express_or_through_the_stream_all_is_the_same(deeds, nodelay, model):
    """Rows, what ends know and when, and what is counted: over cuts, delays above TCP's timeout,
    stops and closing."""
    the_same([(0, ("call",)), *deeds], nodelay=nodelay, model=model)


def pair_with(*deeds):
    """Log and rows of what is done with a connection; the same through the stream."""
    def play():
        pair = Pair(wire(), params=IMPLIED)
        pair.call(nodelay=True)
        for time_ns, deed in deeds:
            pair.at(time_ns, deed, pair)
        pair.run(10 * S)
        return pair.log, pair.rows()

    outcome = play()
    with patch.object(Express, "send", through_the_stream):
        assert play() == outcome
    return outcome


def say(pair):
    pair.say(len(pair.log))


def say_the_last(pair):
    """Who hears it closes."""
    pair.connection.send(0, 800, lambda _: pair.close(1), Word(100))


@pytest.mark.parametrize("before", [[], [(S, say)]])
def test_who_closes_when_it_hears_something_is_told_nothing_more(before):
    log, _ = pair_with(*before, (2 * S, say_the_last), (2 * S + 20_000, say), (3 * S, say))
    assert len([row for row in log if row[1] == "heard"]) == len(before)


def test_what_a_host_has_sent_before_it_stops_is_not_heard_any_more():
    log, _ = pair_with((S, say), (2 * S, say), (2 * S + 2000, lambda pair: pair.stop(0)))
    assert [row[0] for row in log if row[1] == "heard"] == [S + 4360]


def forgetful(express):
    """A broken ``Express.join``: what is on its way never gets into the stream."""
    express.ready = False
    express.flight = None


def impatient(express, *_):
    """A broken ``Express._follows``: Nagle does not count."""
    return True


SLOWED = [(0, ("call",)), (S, SAY), (S, ("set_slow", 250 * MS)), (0, SAY),
          (S, ("set_slow", 0)), (S, SAY)]
HELD = [(0, ("call",)), (S, SAY), (S, SAY), (1, ("say", 0, 801))]


@pytest.mark.parametrize("part, broken, deeds", [
    ("join", forgetful, SLOWED), ("_follows", impatient, HELD)])
def test_a_broken_express_is_found(part, broken, deeds):
    wanted = the_same(deeds, nodelay=False)
    try:
        with patch.object(Express, part, broken):
            got = walked(wire(), deeds, False)
    except (AssertionError, StopIteration):
        return
    assert got != wanted


def large_and_small(time_ns):
    return [(time_ns, LARGE), (1000, SAY)]


@pytest.mark.parametrize("deeds", [
    [(S, LARGE), *large_and_small(S), *large_and_small(10 * S)],
    [(S, LARGE), *[(100 * MS, LARGE)] * 5, *large_and_small(100 * MS)]])
def test_the_window_grows_and_shrinks_by_express_as_well(deeds):
    """A small message behind a large one goes at once where large ones went before, but not after
    a pause."""
    log, *_ = the_same([(0, ("call",)), (S, SAY), *deeds], nodelay=True)
    assert [row[2] for row in log if row[1] == "heard"] == list(range(len(deeds) + 1))


def test_the_timer_runs_for_the_first_that_is_on_its_way():
    """Both take 150 ms; the second is sent 100 ms after the first, which would be too late for it
    250 ms after that."""
    _, rows, *_ = the_same([
        (0, ("call",)), (S, SAY), (S, ("set_slow", 150 * MS)), (0, SAY),
        (100 * MS, SAY), (S, ("set_slow", 0))], nodelay=True)
    assert len([row for row in rows if row[1] == "frame"]) == 3, "none was sent again"


def test_what_goes_by_express():
    """All but what a client says before it has seen that the server knows it."""
    pair = Pair(wire(), params=IMPLIED)
    pair.call(nodelay=True)
    for k in range(50):
        pair.at(S + k * MS, pair.say, k, 800).at(S + k * MS, pair.say, 100 + k, 800)
    with patch.object(Receiver, "arrived", autospec=True, side_effect=Receiver.arrived) as arrived:
        pair.run(2 * S)
    assert len(pair.heard()) == 100 and arrived.call_count == 2
    assert pair.connection.sender(0).express is not None


@pytest.mark.parametrize("model, params", [
    (wire, {}), (lambda: link(rate="1 Gb/s", latency="1 ms"), IMPLIED), (wire, {
        "acks": "implied", "near": "0 ns"})])
def test_where_nothing_goes_by_express(model, params):
    pair = Pair(model(), params=params)
    pair.call()
    pair.run(S)
    assert pair.connection.sender(0).express is pair.connection.sender(1).express is None
