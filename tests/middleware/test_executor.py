"""Nodes whose callbacks take time, shown by small whole logs.

Times are in ms where nothing else is said; messages between hosts arrive at once."""

from fractions import Fraction
from inspect import getsourcelines
from operator import attrgetter

import pytest
from graphs import MS, Net, S, Words, silent, talker
from hypothesis import given
from hypothesis import strategies as st

from desim.errors import KernelError, ModelError


class Fixed:
    """Times of callbacks by node, and of messages."""

    def __init__(self, receive=0, send=0, **callbacks):
        self.receive, self.send, self.callbacks = receive, send, callbacks
        self.asked = []

    def callback_ns(self, work):
        self.asked.append(work)
        return self.callbacks.get(work.node, 0) * MS

    def send_ns(self, topic, size_bytes, links):
        return links * self.send * MS

    def receive_ns(self, topic, size_bytes):
        return self.receive * MS


class Log(list):
    """Lines (time, node, ...)."""

    def hears(self, topic, queue=1):
        """Starts a node that logs what it hears."""
        return lambda node: node.subscribe(topic, lambda message: self.note(
            node, message.content.text), queue)

    def answers(self, topic, answer, queue=1):
        """Starts a node that logs what it hears and says it on ``answer``."""
        def begin(node):
            def heard(message):
                self.note(node, message.content.text)
                node.publish(answer, message.content)
            node.advertise(answer, queue=0)
            node.subscribe(topic, heard, queue)
        return begin

    def ticks(self, hz, start="zero", work=None):
        """Starts a node that logs each tick of a timer."""
        def begin(node):
            node.timer(hz, lambda k: (self.note(node, k), node.worked(**work or {})), start,
                       name="beat")
        return begin

    def note(self, node, what):
        time_ns = node.now_ns
        self.append((time_ns // MS if time_ns % MS == 0 else time_ns / MS, node.name, what))


@pytest.fixture
def log():
    return Log()


WORDS = [(0 * MS, "one"), (10 * MS, "two"), (20 * MS, "three"), (30 * MS, "four")]


def robot(**nodes):
    """Node names to what starts them, all on one host."""
    return {"robot": nodes}


def says(words, topic="/talk"):
    return talker(words, topic, queue=0)


# ----------------------------------------------------------------------------------- one callback


def test_messages_are_held_back_while_a_callback_runs(log):
    net = Net(robot(mouth=says(WORDS[:1]), mind=log.answers("/talk", "/answer"),
                    ear=log.hears("/answer")), costs=Fixed(mind=30))
    net.run(S)
    assert log == [(0, "mind", "one"), (30, "ear", "one")]
    assert net.graph.host("robot").computer.processors.busy_ns() == 30 * MS


def test_a_message_is_born_when_it_leaves(log):
    net = Net({"a": says(WORDS[:1]), "b": log.answers("/talk", "/answer"),
               "c": log.hears("/answer")}, costs=Fixed(node=30))
    net.run(S)
    # a's own callback, the timer in which it speaks, takes 30 ms, too.
    assert [(time_ns // MS, entity) for time_ns, kind, entity, *_ in net.rows("sent")] == [
        (30, "a"), (60, "b")]


def test_a_message_leaves_with_the_callback_that_publishes_it_whosever_it_is(log):
    """Nodes of one host share objects: what one does may make another one speak."""
    def first(node):
        node.advertise("/said", queue=0)
        first.speak = lambda: node.publish("/said", Words("as asked"))

    def second(node):
        node.subscribe("/talk", lambda message: (node.worked(cells=7), first.speak()))
    costs = Fixed(second=40)
    net = Net(robot(first=first, second=second, mouth=says(WORDS[:1]), ear=log.hears("/said")),
              costs=costs)
    net.run(S)
    assert log == [(40, "ear", "as asked")]
    assert costs.asked[1].quantities == {"cells": 7, "bytes": 100}


def test_a_busy_node_takes_the_newest_message_and_loses_those_between(log):
    net = Net(robot(mouth=says(WORDS), mind=log.hears("/talk")), costs=Fixed(mind=25))
    net.run(S)
    assert log == [(0, "mind", "one"), (25, "mind", "three"), (50, "mind", "four")]
    counts = net.counts("/talk")
    assert (counts.queued, counts.called, counts.overwritten) == (4, 3, 1)
    assert [row[0] // MS for row in net.rows("overwritten")] == [20]


def test_a_longer_queue_keeps_them(log):
    net = Net(robot(mouth=says(WORDS), mind=log.hears("/talk", queue=2)), costs=Fixed(mind=25))
    net.run(S)
    assert log == [(0, "mind", "one"), (25, "mind", "two"), (50, "mind", "three"),
                   (75, "mind", "four")]
    net = Net(robot(mouth=says(WORDS), mind=log.hears("/talk", queue=2)), costs=Fixed(mind=35))
    net.run(S)
    assert [line[2] for line in log[4:]] == ["one", "three", "four"]


def test_a_new_message_takes_the_turn_of_the_one_that_it_overwrites(log):
    def mind(node):
        node.subscribe("/a", lambda message: log.note(node, message.content.text))
        node.subscribe("/b", lambda message: log.note(node, message.content.text))
    net = Net(robot(a=says([(0, "a1"), (10 * MS, "a2"), (30 * MS, "a3")], "/a"),
                    b=says([(20 * MS, "b1")], "/b"), mind=mind), costs=Fixed(mind=40))
    net.run(S)
    assert log == [(0, "mind", "a1"), (40, "mind", "a3"), (80, "mind", "b1")]


def test_a_node_runs_one_callback_at_a_time_however_many_processors_there_are(log):
    def mind(node):
        for topic in ("/a", "/b"):
            node.subscribe(topic, lambda message: log.note(node, message.content.text))
    net = Net(robot(a=says(WORDS[:1], "/a"), b=says([(0, "uno")], "/b"), mind=mind),
              costs=Fixed(mind=40), processors=4)
    net.run(S)
    assert log == [(0, "mind", "one"), (40, "mind", "uno")]


# -------------------------------------------------------------------------- nodes of one computer


def two_minds(log, **options):
    net = Net(robot(mouth=says(WORDS[:1]), first=log.answers("/talk", "/done"),
                    second=log.answers("/talk", "/done"), ear=log.hears("/done", queue=0)),
              costs=Fixed(first=30, second=10), **options)
    net.run(S)
    return [line for line in log if line[1] == "ear"]


@pytest.mark.parametrize(("discipline", "processors", "done"), [
    ("fifo", 1, [40, 40]), ("fifo", 2, [10, 30]), ("fixed_priority", 1, [40, 40]),
    ("processor_sharing", 1, [20, 40]), ("processor_sharing", 2, [10, 30])])
def test_nodes_wait_for_each_other_where_processors_are_few(log, discipline, processors, done):
    # On one processor, in line, the ear comes after both of them.
    assert [time for time, *_ in two_minds(log, discipline=discipline, processors=processors)
            ] == done


def test_a_node_with_a_higher_priority_goes_first(log):
    heard = two_minds(log, discipline="fixed_priority", priorities={"second": 1, "ear": 2})
    assert [time for time, *_ in heard] == [10, 40]
    # The first one had begun: it was preempted when it had done nothing yet.
    assert log[:2] == [(0, "first", "one"), (0, "second", "one")]


def test_priority_inversion(log):
    """A node with the highest priority waits for a message of one with the lowest, which a third
    one keeps from the processor: it waits as long as if it had the lowest priority itself."""
    def played(priorities):
        log.clear()
        Net({"sensors": {"laser": says([(0, "scan")], "/scan"),
                         "lens": says([(1 * MS, "image")], "/image")},
             "robot": {"pose": log.answers("/scan", "/pose"), "camera": log.hears("/image"),
                       "drive": log.hears("/pose")}},
            costs=Fixed(pose=10, camera=500, drive=5), discipline="fixed_priority",
            priorities=priorities).run(S)
        return next(time for time, node, _ in log if node == "drive")

    assert played({"drive": 3, "camera": 2, "pose": 1}) == 510
    assert played({"drive": 3, "camera": 2, "pose": 3}) == 10  # inherited (Sha et al. 1990)


def test_a_slow_computer_takes_longer(log):
    Net(robot(mouth=says(WORDS[:1]), mind=log.answers("/talk", "/answer"),
              ear=log.hears("/answer")), costs=Fixed(mind=30), speed=Fraction(1, 20)).run(S)
    assert log == [(0, "mind", "one"), (600, "ear", "one")]


def test_computers_do_not_wait_for_each_other(log):
    net = Net({"a": {"mouth": says(WORDS[:1]), "mind": log.hears("/talk")},
               "b": {"mind": log.hears("/talk")}}, costs=Fixed(mind=30))
    net.run(S)
    assert [net.graph.host(name).computer.processors.busy_ns() for name in "ab"] == [30 * MS] * 2


# ------------------------------------------------------------------------------------------ timers


def test_timers_of_a_node_that_is_fast_enough_stay_on_their_grid(log):
    net = Net(robot(clock=log.ticks(100)), costs=Fixed(clock=9))
    net.run(45 * MS)
    assert log == [(0, "clock", 0), (10, "clock", 1), (20, "clock", 2), (30, "clock", 3),
                   (40, "clock", 4)]
    assert net.graph.host("robot").missed_ticks == 0


def test_a_late_callback_does_not_move_the_grid(log):
    """roscpp: the next one is due a period after that one was, not after it was called."""
    def clock(node):
        log.ticks(100)(node)
        node.subscribe("/talk", lambda message: log.note(node, message.content.text))
    costs = Fixed()
    costs.callback_ns = lambda work: 16 * MS if work.trigger == "talk" else MS
    net = Net(robot(clock=clock, mouth=says([(2 * MS, "hold on")])), costs=costs)
    net.run(35 * MS)
    # The words leave after the millisecond that the mouth's callback takes.
    assert log == [(0, "clock", 0), (3, "clock", "hold on"), (19, "clock", 1), (20, "clock", 2),
                   (30, "clock", 3)]
    assert net.graph.host("robot").missed_ticks == 0


def test_timers_that_come_while_their_node_is_busy_do_not_pile_up(log):
    """Each callback of 35 ms makes the next one late by more than a period of 10 ms: it is called
    at once, from where the timer starts anew, and those between are lost."""
    net = Net(robot(clock=log.ticks(100)), costs=Fixed(clock=35))
    net.run(110 * MS)
    assert log == [(0, "clock", 0), (35, "clock", 1), (70, "clock", 2), (105, "clock", 3)]
    assert net.graph.host("robot").missed_ticks == 6  # of 10, 20; 45, 55; 80, 90


def test_ticks_count_as_missed_while_their_node_is_still_busy(log):
    """The first callback, or another one's that the timer waits for, does not end in this run."""
    for costs, missed in ((Fixed(clock=10_000), 8), (Fixed(clock=1), 0)):  # of 20 to 90; the twin
        net = Net(robot(clock=log.ticks(100)), costs=costs)
        net.run(95 * MS)
        assert net.graph.host("robot").missed_ticks == missed

    def clock(node):
        log.ticks(100)(node)
        node.subscribe("/talk", lambda _: None)
    costs = Fixed()
    costs.callback_ns = lambda work: 10 * S if work.trigger == "talk" else MS
    net = Net(robot(clock=clock, mouth=says([(2 * MS, "hold on")])), costs=costs)
    net.run(95 * MS)
    assert net.graph.host("robot").missed_ticks == 7  # 10 is called then, at once 20; 30 to 90


def test_a_cancelled_timer_that_waits_is_not_called(log):
    def clock(node):
        timer = node.timer(100, lambda k: log.note(node, k), "zero")
        node.subscribe("/talk", lambda _: (log.note(node, "stop"), timer.cancel()))
    Net(robot(clock=clock, mouth=says([(5 * MS, "stop")])), costs=Fixed(clock=8)).run(S)
    assert log == [(0, "clock", 0), (8, "clock", "stop")]


def test_a_call_that_is_set_for_later_waits_for_its_node(log):
    def clock(node):
        node.after(5 * MS, lambda _: log.note(node, "a"))
        node.after(6 * MS, lambda _: log.note(node, "b"))
        node.after(7 * MS, lambda _: log.note(node, "c")).cancel()
    Net(robot(clock=clock), costs=Fixed(clock=20)).run(S)
    assert log == [(5, "clock", "a"), (25, "clock", "b")]


def test_a_tick_falls_due_while_its_node_waits_for_the_processor(log):
    """The node's last callback was that timer's, long ago: the tick is no second one of it."""
    def clock(node):
        log.hears("/talk")(node)
        log.ticks(10)(node)
    net = Net({"robot": {"clock": clock, "hog": log.hears("/load")},
               "mouth": {"load": says([(60 * MS, "much")], "/load"),
                         "talk": says([(70 * MS, "hello")])}},
              costs=Fixed(clock=5, hog=200), discipline="fifo")
    net.run(300 * MS)
    assert log == [(0, "clock", 0), (60, "hog", "much"), (260, "clock", "hello"), (265, "clock", 1),
                   (270, "clock", 2), (300, "clock", 3)]


# --------------------------------------------------------------------------------- what is charged


def test_a_callback_is_charged_for_what_its_node_says_that_it_did(log):
    costs = Fixed()
    Net(robot(clock=log.ticks(10, work={"beams": 181, "particles": 30}), mind=log.hears("/talk"),
              mouth=says(WORDS[:1])), costs=costs).run(50 * MS)
    assert [(work.node, work.trigger, dict(work.quantities)) for work in costs.asked] == [
        ("clock", "beat", {"beams": 181, "particles": 30}), ("mouth", "timer", {}),
        ("mind", "talk", {"bytes": 100})]


def test_sender_and_receivers_are_charged_for_messages(log):
    net = Net({"a": says(WORDS[:1]), "b": log.hears("/talk"), "c": log.hears("/talk")},
              costs=Fixed(receive=5, send=3))
    net.run(S)
    assert [net.graph.host(name).computer.processors.busy_ns() // MS for name in "abc"] == [6, 5, 5]
    assert net.rows("sent")[0][0] == 6 * MS  # serialized and written first
    assert net.rows("callback")[0][0] == 6 * MS


def test_a_message_that_nobody_reads_costs_nothing_to_send():
    net = Net({"a": says(WORDS)}, costs=Fixed(send=3))
    net.run(S)
    assert net.graph.host("a").computer.processors.busy_ns() == 0


def test_messages_that_are_overwritten_were_received_too(log):
    net = Net(robot(mouth=says(WORDS), mind=log.hears("/talk")), costs=Fixed(receive=1, mind=60))
    net.run(S)
    assert log == [(0, "mind", "one"), (61, "mind", "four")]
    assert net.graph.host("robot").computer.processors.busy_ns() == (1 + 60 + 3 + 60) * MS


def test_polled_messages_are_received_at_the_nodes_next_callback(log):
    """A node that spins at its own rate reads the newest and pays for all that came."""
    def polling(node):
        latest = node.latest("/talk")
        node.timer(20, lambda _: log.note(node, latest.read() and latest.read().content.text),
                   "zero")
    net = Net({"a": says(WORDS), "b": {"first": polling, "second": polling}},
              costs=Fixed(receive=1), processors=2)
    net.run(60 * MS)
    assert log == [(0, "first", None), (0, "second", None), (50, "first", "four"),
                   (50, "second", "four")]
    assert net.graph.host("b").computer.processors.busy_ns() == 2 * 4 * MS


def test_work_that_has_no_name_is_refused(log):
    net = Net(robot(clock=log.ticks(10, work={"beam": 3})), costs=Fixed())
    with pytest.raises(ModelError) as refused:
        net.run(S)
    assert str(refused.value) == (
        "node 'clock' worked beam=3 (did you mean 'beams'?); known: bytes, scans, beams, "
        "particles, cells, candidates, plans")


@pytest.mark.parametrize("answer", [-1, 1.5, None])
def test_a_cost_that_is_none_is_refused(log, answer):
    class Wrong(Fixed):
        def callback_ns(self, work):
            return answer

    net = Net(robot(clock=log.ticks(10)), costs=Wrong())
    with pytest.raises(ModelError) as refused:
        net.run(S)
    assert str(refused.value) == (
        f"test_executor.{Wrong.callback_ns.__qualname__} (test_executor.py:"
        f"{getsourcelines(Wrong.callback_ns)[1]}) answered {answer} to Work(node='clock', "
        "trigger='beat', quantities={}); wanted: an int >= 0, in ns")


def test_callbacks_that_cost_nothing_and_wake_each_other_are_an_error():
    def echo(node):
        node.advertise("/talk", queue=0)
        node.subscribe("/talk", lambda message: node.publish("/talk", message.content), 0)
        node.after(0, lambda _: node.publish("/talk", Words("again")))
    net = Net(robot(echo=echo), costs=Fixed())
    with pytest.raises(KernelError) as refused:
        net.run(S)
    assert str(refused.value) == ("more than 100000 callbacks on robot at 0 ns: they cost nothing "
                                  "and wake each other")


# ------------------------------------------------------------------------------------ hosts' lives


@pytest.fixture(params=["stop", "stop_software"])
def ending(request):
    """Ends the software of a host: with its interfaces, and without."""
    return attrgetter(request.param)


def test_a_host_that_stops_forgets_what_waits_and_what_it_was_about_to_say(log, ending):
    net = Net({"a": says(WORDS), "b": {"mind": log.answers("/talk", "/answer", queue=5)},
               "c": log.hears("/answer")}, costs=Fixed(mind=15))
    net.at(40 * MS, ending(net.graph.host("b")))
    net.run(S)
    assert log == [(0, "mind", "one"), (15, "mind", "two"), (15, "node", "one"),
                   (30, "mind", "three"), (30, "node", "two")]
    counts = net.counts("/talk")
    assert counts.queued == counts.called + counts.overwritten + counts.discarded
    assert counts.discarded == 1


def test_a_host_that_starts_again_runs_its_callbacks_afresh(log, ending):
    net = Net(robot(clock=log.ticks(100)), costs=Fixed(clock=35))
    host = net.graph.host("robot")
    net.at(20 * MS, ending(host))
    net.at(50 * MS, host.start)
    net.run(90 * MS)
    assert log == [(0, "clock", 0), (50, "clock", 0), (85, "clock", 1)]
    assert host.computer.processors.busy_ns() == (20 + 40) * MS


# --------------------------------------------------------------------------- without costs: as ever


def rows_of(nodes, costs):
    net = Net(nodes, costs=costs)
    net.run(S)
    return net.rows()


times = st.lists(st.tuples(st.integers(0, 60), st.sampled_from(["/a", "/b"])), max_size=12)


@given(times, times, st.integers(0, 3))
def test_callbacks_that_cost_nothing_leave_the_log_of_callbacks_without_computers(
        first, second, queue):
    """Row by row, for fleets that talk to each other and to themselves."""
    def fleet():
        log = Log()
        return {name: {"mouth": lambda node, said=said: [
                    says([(t * MS, f"{t}") for t, topic in said if topic == wanted], wanted)(node)
                    for wanted in ("/a", "/b")],
                       "mind": log.answers("/a", "/answer", queue),
                       "ear": log.hears("/answer", queue), "other": log.hears("/b", queue)}
                for name, said in (("r1", sorted(first)), ("r2", sorted(second)))}
    assert rows_of(fleet(), None) == rows_of(fleet(), Fixed())


def test_they_do_not_where_callbacks_cost_something():
    fleet = {"r1": {"mouth": says(WORDS), "mind": Log().answers("/talk", "/answer")},
             "r2": {"ear": Log().hears("/answer")}}
    assert rows_of(fleet, None) != rows_of(fleet, Fixed(mind=1))


def test_a_silent_computer_is_idle():
    net = Net({"a": silent}, costs=Fixed(receive=1, send=1, node=1))
    net.run(S)
    assert net.graph.host("a").computer.processors.busy_ns() == 0 and net.kernel.events == 0
