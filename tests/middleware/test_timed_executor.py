"""The time of callbacks before the birth of their messages, by hand, in ms."""

from fractions import Fraction

from graphs import MS, Net, S, Words, talker
from hypothesis import given
from hypothesis import strategies as st
from ledgers import rows_of, table_of_net

from desim.computers.processors import Processors
from desim.middleware.busy.timed_executor import TimedExecutor
from desim.middleware.message_ledger import MessageLedger
from desim.network.passages import Passages
from desim.results.why import BUSY, READ, Query, breakdown


class Costs:
    """Times of callbacks by node, in ms; messages cost nothing."""

    def __init__(self, **callbacks):
        self._callbacks = callbacks

    def callback_ns(self, work):
        return self._callbacks.get(work.node, 0) * MS

    def send_ns(self, topic, size_bytes, links):
        return 0

    def receive_ns(self, topic, size_bytes):
        return 0


def answers(topic, answer="/done", queue=0):
    """Starts a node that answers each message of ``topic``."""
    def begin(node):
        node.advertise(answer, queue=0)
        node.subscribe(topic, lambda message: node.publish(answer, message.content), queue)
    return begin


def hears(topic):
    return lambda node: node.subscribe(topic, lambda message: None, queue=0)


def says(*times, topic="/talk"):
    return talker([(time * MS, str(time)) for time in times], topic, queue=0)


def played(robot, costs, *further, ledger=None, **options):
    """The callbacks on the host ``robot``: node, when it was called, and the parts. Another host
    hears ``/done``, and ``further`` talk."""
    ledger = MessageLedger(Passages()) if ledger is None else ledger
    nodes = {"robot": robot, "base": {"ear": hears("/done"), **{
        f"mouth_{k}": one for k, one in enumerate(further)}}}
    net = Net(nodes, ledger=ledger, costs=costs, **options).run(S)
    return net, [(one.node, *(time_ns / MS for time_ns in one[3:])) for one in ledger.callbacks
                 if one.node in robot]


TWO = {"first": answers("/talk"), "second": answers("/talk")}
# The second message comes at 10: the first node works until 30 on the first one, and then is behind
# the second node, whose turn lasts from 0 to 40 as it waits for the processor until 30.
IN_LINE = [("first", 0, 0, 0, 30), ("second", 30, 0, 30, 10), ("first", 40, 20, 10, 30),
           ("second", 70, 30, 30, 10)]


def in_line():
    return played(TWO, Costs(first=30, second=10), says(0, 10), discipline="fifo")[1]


def test_callbacks_wait_for_their_node_and_for_the_processor():
    assert in_line() == IN_LINE


def test_turns_that_are_not_noted_are_not_those(monkeypatch):
    """The twin of the test above."""
    monkeypatch.delattr(TimedExecutor, "step")
    assert in_line() != IN_LINE


def test_a_shared_processor_is_waited_for_as_well():
    assert played(TWO, Costs(first=30, second=10), says(0))[1] == [
        ("second", 0, 0, 10, 10), ("first", 0, 0, 10, 30)]
    assert played(TWO, Costs(first=30, second=10), says(0), processors=2)[1] == [
        ("second", 0, 0, 0, 10), ("first", 0, 0, 0, 30)]


def test_a_slow_processor_computes_longer():
    def slow():
        return played(TWO, Costs(first=30), says(0), speed=Fraction(1, 3))[1]
    assert slow()[-1] == ("first", 0, 0, 0, 90)


def test_without_the_speed_it_would_seem_to_wait(monkeypatch):
    """The twin of the test above."""
    monkeypatch.setattr(Processors, "alone_ns", lambda self, work_ns: work_ns)
    assert played(TWO, Costs(first=30), says(0), speed=Fraction(1, 3))[1][-1] == (
        "first", 0, 0, 60, 30)


def test_a_tick_that_its_node_is_late_for():
    """Control at 10 Hz; at 190 a goal comes, for which the node takes as long as for a tick."""
    def move_base(node):
        node.advertise("/done", queue=0)
        node.subscribe("/goal", lambda message: None, queue=0)
        node.timer(10, lambda k: node.publish("/done", Words(str(k))), "zero", name="control")
    _, found = played({"move_base": move_base}, Costs(move_base=40), says(190, topic="/goal"))
    assert found[:3] == [("move_base", 0, 0, 0, 40), ("move_base", 100, 0, 0, 40),
                         ("move_base", 230, 30, 0, 40)]


def test_what_is_cancelled_leaves_its_place_to_those_behind_it():
    def mind(node):
        node.advertise("/done", queue=0)
        node.subscribe("/talk", lambda message: node.publish("/done", message.content), queue=0)
        node.after(5 * MS, lambda _: late.cancel(), None)
        late = node.after(12 * MS, lambda _: node.publish("/done", Words("never")), None)
    _, found = played({"mind": mind}, Costs(mind=20), says(4, 15))
    # From 4 on, from 24 on (the timer, which cancels what is due since 12), and from 44 on.
    assert found == [("mind", 4, 0, 0, 20), ("mind", 44, 29, 0, 20)]


@given(st.lists(st.tuples(st.sampled_from("abc"), st.integers(0, 60)), max_size=8),
       st.tuples(*3 * [st.integers(0, 25)]), st.integers(1, 2),
       st.sampled_from(["fifo", "fixed_priority", "processor_sharing"]))
def test_the_parts_sum_up_to_the_time_from_arrival_to_birth(said, costs, processors, discipline):
    costs = dict(zip("abc", costs, strict=True))
    nodes = {name: answers(f"/{name}") for name in costs}
    ledger = MessageLedger(Passages())
    played(nodes, Costs(**costs), *(says(time, topic=f"/{name}") for name, time in said),
           ledger=ledger, processors=processors, discipline=discipline, priorities={"a": 1})
    born_ns = {row["number"]: row["born_ns"] for row in rows_of(ledger)}
    for name, cost in costs.items():
        own = [one for one in ledger.callbacks if one.node == name]
        assert [born_ns[one.first] - one.node_queue_ns - one.run_queue_ns - one.computing_ns
                for one in own] == sorted(time * MS for who, time in said if who == name)
        assert all(one.node_queue_ns >= 0 and one.run_queue_ns >= 0
                   and one.computing_ns == cost * MS for one in own)


# ------------------------------------------------------------------------------ the ledger's table


def table_of(robot, costs, *talk, **options):
    return table_of_net(lambda ledger: played(robot, costs, *talk, ledger=ledger, **options)[0])


def test_the_table_has_what_was_before_the_birth_and_who_was_busy():
    table = table_of(TWO, Costs(first=30, second=10), says(0, 10), discipline="fifo")
    done = breakdown(table, Query(topic="/done", late=10)).messages
    assert sorted((one.born_ns // MS, *(part[:1] + (part.time_ns // MS,) for part in one.before))
                  for one in done) == [
        (30, ("computing", 30)), (40, ("run queue", 30), ("computing", 10)),
        (70, ("node's queue", 20), ("run queue", 10), ("computing", 30)),
        (80, ("node's queue", 30), ("run queue", 30), ("computing", 10))]
    assert {part.place for one in done for part in one.before} == {"robot first", "robot second"}
    talk = breakdown(table, Query(topic="/talk", late=10)).messages
    assert [(one.before, one.waited_ns // MS, one.waited_in) for one in talk] == [
        ((), 0, READ), ((), 30, BUSY)]  # the first node calls it at 40
    found = breakdown(table, Query())
    assert {part: time_ns // MS for part, time_ns in found.times_ns.items()} == {
        "node's queue": 50, "run queue": 70, "computing": 80, BUSY: 30}


def test_a_node_that_looks_when_it_likes_is_not_busy():
    def mind(node):
        latest = node.latest("/talk")
        node.timer(10, lambda k: latest.read(), "zero", name="look")
    table = table_of({"mind": mind}, Costs(mind=30), says(60))
    one, = breakdown(table, Query()).messages
    assert (one.waited_ns, one.waited_in) == (40 * MS, READ)


def test_ideal_computers_do_nothing_before_a_birth():
    table = table_of(TWO, None, says(0, 10))
    for column in ("node", "called_ns", "node_queue_ns", "run_queue_ns", "computing_ns"):
        assert table[column].null_count == len(table) > 0
    assert not any(one.before for one in breakdown(table, Query()).messages)


def test_a_ledger_changes_nothing():
    def log(**options):
        nodes = {"robot": TWO, "base": {"ear": hears("/done"), "mouth": says(0, 10, 40)}}
        return Net(nodes, costs=Costs(first=30, second=10), **options).run(S).rows()
    assert log() == log(ledger=MessageLedger(Passages()))
