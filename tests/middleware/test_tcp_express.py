"""Messages by express: the same rows, for less."""

from unittest.mock import patch

import pytest
from graphs import MS, S
from hypothesis import example, given
from hypothesis import strategies as st
from tcp_hosts import Pair, Word, link
from tcp_walk import DEEDS, Walk

from desim.middleware.tcp.implied_acknowledgements import Express, ImpliedReceiver
from desim.network.carrier import Carrier
from desim.ports import Deliver
from netmodels.access_link import AccessLink
from netmodels.ideal import Ideal
from netmodels.switch import Switch

IMPLIED = {"acks": "implied"}


def wire():
    """1 us a kilobit, 3 us to the other side: near, as TCP sees it."""
    return link(rate="1 Gb/s", latency="3 us")


class Taciturn(AccessLink):
    """It settles what it is sent by itself, and does not say when it will be there."""

    def start(self, context, hosts):
        super().start(context, hosts)
        self._settle = context.settle

    def send(self, frame):
        delay_ns = super().send(frame)
        if delay_ns is not None:
            self._settle(frame, frame.receivers[0], Deliver(delay_ns))


def taciturn():
    return Taciturn(AccessLink.Params(rate="1 Gb/s", latency="3 us"))


def narrow():
    """Still near for a SYN."""
    return link(rate="50 Mb/s", queue="100 kB")


def far():
    """Too far for TCP to take it for near: only single segments go by express."""
    return link(rate="100 Mb/s", latency="1 ms")


def lossy():
    """Far, with a queue that soon loses some: windows shrink and grow."""
    return link(rate="10 Mb/s", latency="2 ms", queue="20 kB")


def switch():
    return Switch(Switch.Params())


def crowded():
    return Switch(Switch.Params(buffer="20 kB"))


def ideal():
    return Ideal(Ideal.Params())


class Busy(Walk):
    """There are others, too."""

    def crowd(self, source, size_bytes):
        self.net.medium.transmit(source, (1 - source,), size_bytes, 1, False, Carrier(), None)


def outcome(walk):
    medium = walk.net.medium
    context = walk.net.graph.context
    return (walk.log, walk.rows(), walk.fates, medium.frames, medium.delivered, medium.dropped,
            medium.tx_bytes, medium.rx_bytes, context.discovery_bytes, context.discovery_frames,
            walk.at_rest())


def walked(model, deeds, nodelay, params=IMPLIED):
    walk = Busy(model, params=params)
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
    DEEDS, st.tuples(st.just("say"), st.integers(0, 1), st.sampled_from([400_000, 3_500_000])),
    st.tuples(st.just("crowd"), st.integers(0, 1), st.sampled_from([1000, 100_000, 5_000_000])),
    st.tuples(st.just("note_ends")), st.tuples(st.just("wait"), st.integers(0, 1)))
SAY, LARGE = ("say", 0, 800), ("say", 0, 60_000)
CUT, MENDED = ("disturb", "mute", (0, 1)), ("disturb", "mute", ())
PROMPT = "disturb", "late", (0, 0)


ASK, LAST = ("say", 0, 800, 800), ("say_last", 0, 800)
SLOW, SLOWER = ("disturb", "late", (1, 150 * MS)), ("disturb", "late", (1, 250 * MS))
TWICE = "disturb", "copied", (1, 10 * MS)


@example([(S, SAY), (S, SAY), (2000, ("close", 1))], False, wire)  # while it is on its way
@example([(S, SAY), (S, SAY), (2000, ("stop", 0))], False, wire)
@example([(S, SAY), (S, SAY), (2000, ("close", 0)), (S, ("note_ends",))], False, wire)
@example([(S, SAY), (S, LARGE), (9000, ("note_ends",))], False, wire)
@example([(S, SAY), (S, LARGE), (9000, ("wait", 0))], False, wire)
@example([(S, SAY), (1000, SLOW), (60 * S - 10 * MS, SAY), (S, PROMPT)], False, wire)
@example([(S, SAY), (S, SLOW), (0, SAY), (120 * MS, SLOWER), (0, SAY), (S, PROMPT)], True, wire)
@example([(S, SAY), (S, SAY), (1000, SLOW), (0, SAY), (500, ("stop", 1)), (S, ("start", 1))], True,
         wire)  # timeouts from when the first was sent, or the last has come
@example([(S, SAY), (S, ("disturb", "late", (1, 200 * MS))), (0, SAY), (S, PROMPT)], True, wire)
@example([(S, SAY), *[(S, SLOW), (0, SAY)] * 3, (S, PROMPT), (0, CUT), (0, SAY),
          (500 * MS, MENDED), (S, ("note_ends",))], False, wire)  # a timeout by round trips
@example([(S, SAY), *[(S, ("say", 0, 300_000))] * 8, (S, ("say", 0, 3_500_000))], True, narrow)
@example([(S, SAY), (S, ("say", 0, 400_000))], False, wire)
@example([(S, SAY), (S, CUT), (0, SAY), (S, MENDED), (S, SAY), (S, ("say", 0, 200_000))], False,
         wire)
@example([(S, SAY), (S, ASK), (5000, CUT), (10_000, MENDED), (S, SAY)], False, wire)
@example([(S, SAY), (S, LAST), (5000, CUT), (10_000, MENDED), (S, SAY)], False, wire)
@example([(S, SAY), (0, TWICE), (S, SAY), (2 * MS, ("stop", 1)), (MS, ("start", 1)), (S, SAY)],
         True, wire)
@example([(S, ("say", 1, 20_000)), (1000, LARGE), (1000, ("say", 1, 3000, 200_000)),
          (36_000, ("say", 1, 60_000)), (MS, ("say", 1, 1449))], False, crowded)
@example([(S, ("crowd", 0, 5_000_000)), (5 * MS, ("say", 0, 1449)), (5000, ("say", 0, 100, 100)),
          (MS, ("say", 0, 1448)), (5000, LAST), (250 * MS, SAY)], False, switch)
@example([(MS, ("say", 0, 3_500_000)), (0, LAST), (1_027_673, ("say", 0, 5000)),
          (MS, ("say_last", 1, 800))], False, wire)
@given(st.lists(st.tuples(GAPS_NS, MORE_DEEDS), max_size=40), st.booleans(),
       st.sampled_from([wire, taciturn, narrow, far, lossy, switch, crowded, ideal]))
def test_by_express_or_through_the_stream_all_is_the_same(deeds, nodelay, model):
    """Rows, what ends know and when, and what is counted, whatever users and the network do."""
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
    """The end that hears it closes."""
    pair.connection.send(0, 800, lambda _: pair.close(1), Word(100))


def say_and_note(pair):
    connection = pair.connection
    connection.send(0, 800, lambda word: pair.note("unacked", connection.unacked(0)), Word(100))


def test_a_sender_knows_of_a_message_when_it_is_heard():
    log, _ = pair_with((S, say), (2 * S, say_and_note))
    assert log[-1][1:] == ("unacked", [])


def test_what_is_on_its_way_is_pending():
    """Of the third message, which goes by express, and after all have been heard."""
    pair, pending = Pair(wire(), params=IMPLIED), []
    pair.call(nodelay=True)
    for k in range(3):
        pair.at(S + k * MS, pair.say, k, 800)
    for time_ns in (S + 2 * MS, 2 * S):
        pair.at(time_ns, lambda: pending.append(pair.connection.sender(0).pending))
    pair.run(2 * S + 1)
    assert pending == [800, 0]


@pytest.mark.parametrize("before", [[], [(S, say)]])
def test_an_end_that_closes_when_it_hears_something_hears_nothing_more(before):
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


SLOWED = [(0, ("call",)), (S, SAY), (S, ("disturb", "late", (1, 250 * MS))), (0, SAY),
          (S, PROMPT), (S, SAY)]
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
        (0, ("call",)), (S, SAY), (S, ("disturb", "late", (1, 150 * MS))), (0, SAY),
        (100 * MS, SAY), (S, PROMPT)], nodelay=True)
    assert len([row for row in rows if row[1] == "frame"]) == 3, "none was sent again"


class Late:
    """A network of 3 us, but for a second in which it takes as long as TCP's least timeout."""

    reasons = ()

    def start(self, context, hosts):
        self._context = context

    def send(self, frame):
        return 208 * MS if 2 * S <= self._context.now_ns < 3 * S else 3000


def test_what_takes_as_long_as_the_timeout_is_sent_again():
    log, rows, *_ = the_same([(0, ("call",)), (S, SAY), (S, SAY)], nodelay=False, model=Late)
    assert len([row for row in rows if row[1] == "frame"]) == 3
    assert [row[2] for row in log if row[1] == "heard"] == [0, 1]


def test_what_goes_by_express():
    """All but what a client says before it has seen that the server knows it."""
    with patch.object(ImpliedReceiver, "arrived", autospec=True,
                      side_effect=ImpliedReceiver.arrived) as arrived:
        pair = Pair(wire(), params=IMPLIED)
        pair.call(nodelay=True)
        for k in range(50):
            pair.at(S + k * MS, pair.say, k, 800).at(S + k * MS, pair.say, 100 + k, 800)
        pair.run(2 * S)
    assert len(pair.heard()) == 100 and arrived.call_count == 2
    assert pair.connection.sender(0).express is not None


def test_where_acknowledgements_are_frames_nothing_goes_by_express():
    pair = Pair(wire())
    pair.call()
    pair.run(S)
    assert pair.connection.sender(0).express is pair.connection.sender(1).express is None


def test_between_hosts_that_are_not_near_only_single_segments_go_by_express():
    with patch.object(ImpliedReceiver, "arrived", autospec=True,
                      side_effect=ImpliedReceiver.arrived) as arrived:
        pair = Pair(far(), params=IMPLIED)
        pair.call()
        for k, size_bytes in enumerate([800, 1448, 1449, 3000, 800]):
            pair.at((k + 1) * S, pair.say, k, size_bytes)
        pair.run(10 * S)
    assert len(pair.heard()) == 5 and not pair.connection.sender(0).near
    assert arrived.call_count == 1 + 2  # what a client says first, and the larger ones
