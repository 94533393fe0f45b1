"""Hosts, nodes and topics: who hears what when, and that every message is accounted for."""

from fractions import Fraction

import pytest
from graphs import MS, Life, Net, S, Words, listener, silent, talker
from hypothesis import given, settings
from hypothesis import strategies as st

from desim.errors import InputError
from desim.middleware.contents import Lazy
from desim.middleware.counts import EDGES_NS
from desim.middleware.direct import Direct
from desim.middleware.kernels import bin_of
from desim.middleware.node import Node
from desim.ports import natural_key
from netmodels.access_link import AccessLink
from netmodels.disk import Disk
from netmodels.ideal import Ideal
from netmodels.rules.loss import Loss
from netmodels.switch import Switch


def link(**params):
    return AccessLink(AccessLink.Params(**params))


def test_a_node_in_the_namespace_of_another_host():
    """Its topics, rows and random numbers are those that it would have there."""
    heard, drawn = [], []

    def slam(life):
        node = Node(life.host, "slam", "robot_1")
        drawn.append((node.stream("dice"), node.noise_key("particles")))
        node.advertise("talk")
        node.record("woken", 7)
        node.publish("talk", Words("hello"))
        return node

    def robot(life):
        life.subscribe("talk", lambda message: heard.append(message.about.name))
        assert slam(life).name == "slam"

    def base(life):
        life.subscribe("talk", lambda message: heard.append(message.about.name))
        assert slam(life).name == "robot_1/slam"

    net = Net({"robot_1": robot, "base": base}, Ideal(Ideal.Params())).run(S)
    assert drawn[0] == drawn[1]  # a stream of one name is one object
    assert [row[1:4] for row in net.rows() if row[1] == "woken"] == [("woken", "robot_1", 7)] * 2
    assert heard == ["/robot_1/talk"]  # of the robot's own node: base spoke before it listened


def test_the_whole_log_of_one_message():
    """Published at 1 s, 174 B on the wire at 1 Mb/s: 1.392 ms."""
    heard = []
    net = Net({"robot_2": listener(heard), "robot_10": talker([(S, "hello")])},
              link(rate="1 Mb/s")).run(2 * S)
    at_ns = S + 1_392_000
    assert heard == [(at_ns, "robot_2", "robot_10", "hello")]
    assert net.rows() == [
        (0, "host_started", "robot_2", 0, 0, 0),
        (0, "host_started", "robot_10", 0, 0, 0),
        (S, "sent", "robot_10", "/talk", 1, 100),
        (S, "frame", "robot_10", "robot_2", 1, 174),
        (at_ns, "delivered", "robot_2", "robot_10", 1, 1_392_000),
        (at_ns, "callback", "robot_2", "robot_10", 1, "/talk")]
    assert net.fates == [(1, "robot_2", at_ns, "delivered", S, S)]
    counts = net.counts("/talk")
    assert (counts.intended, counts.delivered, counts.bytes) == (1, 1, 100)
    robots = net.graph.hosts
    assert [(host.name, host.tx_bytes, host.rx_bytes) for host in robots] == [
        ("robot_2", 0, 174), ("robot_10", 174, 0)]


def test_a_host_talks_to_itself_without_a_frame():
    heard = []
    net = Net({"a": {"mouth": talker([(S, "hm")]), "ear": listener(heard)}}).run(2 * S)
    assert heard == [(S, "a", "a", "hm")]
    assert net.rows("sent", "frame", "delivered") == []
    assert net.rows("callback") == [(S, "callback", "a", "a", 1, "/talk")]
    counts = net.counts("/talk")
    assert (counts.intended, counts.called) == (0, 1)


def test_one_frame_per_host_serves_all_its_nodes():
    heard = []
    net = Net({"a": talker([(0, "hello")]),
               "b": {name: listener(heard) for name in ("mapping", "move_base")}}).run(S)
    assert len(heard) == 2
    assert net.medium.frames == 1
    assert (net.counts("/talk").delivered, net.counts("/talk").called) == (1, 2)


def test_a_node_that_only_looks_has_the_newest_message_and_no_callback():
    """Two messages before each look: the second is there, and nothing ran in between."""
    seen = []

    def looker(node):
        latest = node.latest("/talk")
        node.timer(1, lambda _: seen.append(latest.read() and latest.read().content.text),
                   "zero")

    net = Net({"a": talker([(S // 4, "one"), (S // 2, "two"), (S * 5 // 4, "three")]),
               "b": looker}).run(5 * S // 2)
    assert seen == [None, "two", "three"]
    assert net.rows("callback") == []
    counts = net.counts("/talk")
    assert (counts.delivered, counts.queued) == (3, 0)


def test_a_node_that_only_looks_sees_messages_in_the_order_of_their_arrival():
    """The one that was sent first is large, and arrives last: 200 kB at 10 Mb/s take 160 ms."""
    seen = []

    def looker(node):
        latest = node.latest("/talk")
        for time_ns in (20 * MS, 400 * MS):
            node.after(time_ns, lambda _: seen.append(latest.read().content.text))

    Net({"a": talker([(10 * MS, "large")], size_bytes=200_000),
         "b": talker([(11 * MS, "small")]), "c": looker}, link(rate="10 Mb/s")).run(S)
    assert seen == ["small", "large"]


def test_names_are_relative_to_the_host():
    heard = []
    Net({"a": talker([(0, "mine")], topic="pose"), "b": listener(heard, topic="pose"),
         "c": listener(heard, topic="/a/pose")}).run(S)
    assert heard == [(0, "c", "a", "mine")]


def test_what_arrives_in_one_instant_waits_for_its_callback_in_a_bounded_queue():
    """Three messages at once: a queue of one keeps the newest, of two the two newest; callbacks run
    in order of arrival, which is that of the sources' ids."""
    small, large = [], []
    net = Net({"a": talker([(0, "a")]), "b": talker([(0, "b")]), "c": talker([(0, "c")]),
               "d": {"small": listener(small), "large": listener(large, queue=2)}}).run(S)
    order = sorted("abc", key=net.names.id)
    assert [text for *_, text in small] == order[2:]
    assert [text for *_, text in large] == order[1:]
    counts = net.counts("/talk")
    assert (counts.delivered, counts.queued, counts.called, counts.overwritten) == (3, 6, 3, 3)
    assert len(net.rows("overwritten")) == 3


def test_a_callback_may_overwrite_what_waits_behind_it_in_the_same_instant():
    """On one host "/talk" and "/news" wait; the callback of "/talk" says something newer on
    "/news", whose queue of one then lets go of the older."""
    heard = []

    def node(node):
        node.advertise("/talk")
        node.advertise("/news")
        node.subscribe("/talk", lambda message: node.publish("/news", Words("newer")))
        node.subscribe("/news", lambda message: heard.append(message.content.text))
        node.after(S, lambda _: (node.publish("/talk", Words("now")),
                                 node.publish("/news", Words("older"))))

    net = Net({"a": node}).run(2 * S)
    assert heard == ["newer"]
    counts = net.counts("/news")
    assert (counts.queued, counts.called, counts.overwritten) == (2, 1, 1)


def test_callbacks_see_everything_that_arrived_in_their_instant():
    """Deliveries come before callbacks: what a callback says at once is heard a round later."""
    log = []

    def echo(node):
        node.advertise("/echo")
        node.subscribe("/talk", lambda message: (log.append(("talk", message.content.text)),
                                                 node.publish("/echo", Words("again"))), queue=5)
        node.subscribe("/echo", lambda message: log.append(("echo", node.now_ns)), queue=5)

    Net({"a": talker([(S, "one")]), "b": talker([(S, "two")]), "c": echo}).run(2 * S)
    assert [kind for kind, _ in log] == ["talk", "talk", "echo", "echo"]
    assert {what for kind, what in log if kind == "echo"} == {S}


def test_latched_topics_send_latecomers_their_last_message():
    heard = []

    def late(node):
        node.after(5 * S, lambda _: listener(heard)(node))

    net = Net({"a": talker([(0, "old"), (S, "new")], latch=True), "b": late, "c": late,
               "d": silent}).run(10 * S)
    assert sorted(heard) == [(5 * S, "b", "a", "new"), (5 * S, "c", "a", "new")]
    assert {latency for *_, latency in net.rows("delivered")} == {0}


def test_has_subscribers_follows_the_registry():
    answers = []

    def ask(node):
        node.advertise("/talk")
        node.timer(1, lambda k: answers.append(node.has_subscribers("/talk")), start="zero")

    net = Net({"a": ask, "b": listener([])})
    net.at(S // 2, net.graph.host("b").stop)
    net.at(3 * S // 2, net.graph.host("b").start)
    net.run(2 * S)
    assert answers == [True, False, True]


def test_what_nobody_hears_takes_no_number():
    """Rows count what was heard: a listener to the one topic does not see how often the other,
    silent one was published. A latched word is kept without a number until somebody connects."""
    def speaks(node):
        node.advertise("/unheard", latch=True)
        node.advertise("/talk")
        for time_ns in (0, S, 2 * S):
            node.after(time_ns, lambda _: node.publish("/unheard", Words("psst")))
            node.after(time_ns, lambda _: node.publish("/talk", Words("hello")))

    heard = []
    net = Net({"a": speaks, "b": {"ear": listener([]), "late": lambda node: node.after(
        3 * S, lambda _: listener(heard, "/unheard")(node))}}).run(5 * S)
    assert [row[3:5] for row in net.rows("sent")] == [
        ("/talk", 1), ("/talk", 2), ("/talk", 3), ("/unheard", 4)]
    assert heard == [(3 * S, "b", "a", "psst")]


def test_timers_start_where_they_are_set():
    ticks = {}

    def tick(node):
        node.timer(Fraction(10), lambda k: ticks.setdefault(node.host.name, node.now_ns),
                   start="zero" if node.host.name == "a" else "random")

    Net(dict.fromkeys("abc", tick)).run(S)
    assert ticks["a"] == 0
    assert 0 < ticks["b"] < 100 * MS
    assert ticks["b"] != ticks["c"]
    together = ticks.pop("b")
    Net({"b": tick}).run(S)
    assert ticks["b"] == together, "drawn by name, whoever else is there"


def test_a_stopped_host_is_silent_and_comes_back_empty():
    log = []

    def life(node):
        node.advertise("/talk", queue=0)
        node.timer(2, lambda k: (log.append((node.now_ns / S, k)),
                                 node.publish("/talk", Words("tick"))), start="zero")
        node.after(1200 * MS, lambda _: log.append((node.now_ns / S, "after")))
        node.subscribe("/nothing", print)

    net = Net({"a": life, "b": listener([], queue=0)})
    net.at(1100 * MS, net.graph.host("a").stop)
    net.at(1100 * MS, net.graph.host("a").stop)
    net.at(3 * S, net.graph.host("a").start)
    net.run(4 * S)
    assert log == [(0, 0), (0.5, 1), (1, 2), (3, 0), (3.5, 1), (4, 2)]
    assert net.rows("host_stopped", "host_started")[2:] == [
        (1100 * MS, "host_stopped", "a", 0, 0, 0), (3 * S, "host_started", "a", 0, 0, 0)]
    assert [row[4] for row in net.rows("sent")] == [1, 2, 3, 4, 5, 6]


def test_nodes_record_rows_and_draw_by_name():
    drawn = {}

    def life(node):
        node.record("thought", 1, 2, 3)
        drawn[node.host.name, node.name] = node.stream("luck").random()

    net = Net({"a": {"x": life, "y": life}, "b": {"x": life}}).run(0)
    assert net.rows("thought") == [(0, "thought", "a", 1, 2, 3)] * 2 + [
        (0, "thought", "b", 1, 2, 3)]
    assert len(set(drawn.values())) == 3


def test_misuse_is_refused():
    def publish(node):
        node.publish("/talk", Words("hello"))

    for life, says in [(publish, "without advertising"),
                       (lambda node: node.advertise("/x", transport="pigeon"), "no transport"),
                       (lambda node: node.advertise("/x", via="rumour"), "no transport"),
                       (lambda node: node.timer(1, print, start="noon"), "'noon'")]:
        with pytest.raises(InputError, match=says):
            Net({"a": life})
    with pytest.raises(InputError, match="did you mean 'robot_1'"):
        Net({"robot_1": silent}).graph.host("robot1")
    with pytest.raises(InputError, match="payloads"):
        Net({"a": silent}, payloads="never")


def test_what_a_middleware_finds_wrong_has_its_place():
    class Starved(Direct):
        def start(self, context):
            raise InputError(".master: no host 'base'")

    with pytest.raises(InputError, match="^middleware.master: no host 'base'$"):
        Net({"a": silent}, middleware=Starved())


def test_natural_order():
    assert sorted(["robot_10", "base", "robot_2", "7", "robot_02"], key=natural_key) == [
        "7", "base", "robot_02", "robot_2", "robot_10"]


def test_histogram_bins():
    at = EDGES_NS.tolist().index(10**6)
    assert [bin_of(latency_ns, EDGES_NS) for latency_ns in (
        0, 1, 2, 999_999, 10**6, 10**6 + 1, 10**14)] == [0, 0, 1, at, at + 1, at + 1, len(EDGES_NS)]


def chatter(node):
    """Every node talks to all at its own pace, by stream and by datagram."""
    name = node.host.name
    node.advertise(f"/map/{name}", queue=2)
    node.advertise("/beacon", via="broadcast")
    node.advertise("/note", transport="datagram")
    node.timer(Fraction(3), lambda k: node.publish(f"/map/{name}", lazy(k, 20_000)))
    node.timer(Fraction(10), lambda k: node.publish("/beacon", lazy(k, 60)))
    node.timer(Fraction(7), lambda k: node.publish("/note", lazy(k, 3000)))
    for topic in ("/map/a", "/map/b", "/map/c", "/beacon", "/note"):
        node.subscribe(topic, lambda message: node.record("heard", message.content), queue=3)


def lazy(k, size_bytes):
    return Lazy(size_bytes, lambda: k)


MODELS = [lambda: Ideal(Ideal.Params()), lambda: Disk(Disk.Params(rate="2 Mb/s")),
          lambda: link(rate="2 Mb/s", queue="30 kB"),
          lambda: Switch(Switch.Params(rate="10 Mb/s", buffer="20 kB"))]


@settings(max_examples=40, deadline=None)
@given(st.sampled_from(MODELS), st.integers(0, 50),
       st.lists(st.tuples(st.integers(0, 2 * S), st.sampled_from("abc"), st.booleans()),
                max_size=8), st.integers(0, 3 * S))
def test_messages_are_conserved_whatever_stops_and_starts(model, loss_percent, faults, end_ns):
    net = Net(dict.fromkeys("abc", chatter), model(),
              [Loss(Loss.Params(probability=f"{loss_percent} %"))])
    for time_ns, name, up in faults:
        host = net.graph.host(name)
        net.at(time_ns, host.start if up else host.stop)
    net.run(end_ns)
    topics = net.graph.topics.values()
    assert sum(topic.counts.in_flight for topic in topics) >= 0
    in_flight = {topic.name: topic.counts.in_flight for topic in topics}
    rows = net.rows()
    for topic in topics:
        counts = topic.counts
        assert counts.delivered == counts.latencies.sum()
        assert counts.queued == counts.called + counts.overwritten + counts.discarded + sum(
            subscription.waiting for host in net.graph.hosts
            for subscription in host._ends.get(topic.name, ([], []))[1])
    assert sum(topic.counts.delivered for topic in topics) == sum(
        row[1] == "delivered" for row in rows)
    assert sum(topic.counts.called for topic in topics) == sum(row[1] == "callback" for row in rows)
    if not faults:
        assert sum(in_flight.values()) == net.waiting()
    medium = net.medium
    assert medium.intended == medium.delivered + sum(medium.dropped.values()) + medium.in_flight()
    assert len(net.fates) == sum(topic.counts.delivered + sum(topic.counts.dropped.values())
                                 for topic in topics)
    for host in net.graph.hosts:
        net.at(4 * S, host.stop)
    net.run(1000 * S)
    assert all(topic.counts.in_flight == 0 for topic in topics)
    assert medium.in_flight() == 0


def play(hosts="abc", model=MODELS[1], **options):
    return Net({host: silent if host == "quiet" else chatter for host in hosts}, model(),
               [Loss(Loss.Params(probability="20 %"))], **options).run(3 * S)


def test_reading_payloads_at_birth_at_delivery_or_when_wanted_gives_one_digest():
    assert len({play(payloads=when).trace.digest() for when in ("lazy", "birth", "delivery")}) == 1


def test_the_order_of_declaration_changes_nothing():
    for model in MODELS:
        assert play("abc", model).trace.digest() == play("cba", model).trace.digest()


def test_watching_changes_nothing():
    assert play().trace.digest() == play(on_fate=None).trace.digest()


def test_a_silent_host_changes_nobody_elses_rows():
    for model in MODELS:
        alone = play(model=model).trace.digest_by_entity()
        both = play(["a", "quiet", "b", "c"], model).trace.digest_by_entity()
        del both["quiet"]
        assert both == alone


def test_a_listener_that_stands_apart_changes_no_uninvolved_hosts_rows():
    """One more host that hears and says nothing: only the rows of those that talk to it change."""
    nodes = {"a": talker([(k * MS, "x") for k in range(50)]), "b": listener([]),
             "x": talker([(k * MS, "y") for k in range(50)], topic="/other"),
             "y": listener([], topic="/other")}
    before = Net(nodes, MODELS[2]()).run(S).trace.digest_by_entity()
    after = Net({**nodes, "z": listener([], topic="/other")},
                MODELS[2]()).run(S).trace.digest_by_entity()
    assert (after["a"], after["b"]) == (before["a"], before["b"])
    assert after["x"] != before["x"]


def test_software_may_differ_from_host_to_host():
    class Own(Node):
        def start(self):
            self.record("own")

    net = Net({"a": silent})
    host = net.graph.host("a")
    host.stop()
    host.software = lambda host: [Own(host, "own"), Life(host, "life", silent)]
    host.start()
    assert [row[1] for row in net.rows()] == ["host_started", "host_stopped", "host_started", "own"]


def test_a_model_that_follows_hosts_is_notified_of_stops_and_starts():
    notices = []

    class Listening(Ideal):
        def switched(self, host, up):
            notices.append((host, up))

    net = Net({"a": lambda node: None, "b": lambda node: None}, Listening(Ideal.Params()))
    host = net.graph.host("b")
    net.at(MS, host.stop)
    net.at(2 * MS, host.stop)
    net.at(3 * MS, host.start)
    net.run(S)
    assert notices == [(0, True), (1, True), (1, False), (1, True)]
