"""At the end of its scope a rule with a queue hands all that waits to the model, in order."""

import pytest
from graphs import Net, silent

from desim import plugins
from desim.network import scoped_rule
from desim.network.carrier import Carrier
from desim.network.passages import Passages
from desim.network.scoped_rule import Scoped, scoped
from desim.ports import FULL_PACKET_BYTES
from desim.testing import Bench, ImmediateNetwork
from netmodels.access_link import AccessLink

MS, S = 10**6, 10**9
PLACES = {"a": (0, 0), "b": (9, 0), "c": (1, 1)}


def bandwidth(**scope):
    """100 kb/s: 1250 B take 100 ms."""
    return ruled("bandwidth", rate="100 kb/s", burst="1 B", **scope)


def ruled(name, **params):
    found = plugins.parameters("rule", name)(**params)
    return scoped(plugins.load("rule", name)(found), found)


def link():
    """10 Mb/s: 1250 B take 1 ms."""
    return AccessLink(AccessLink.Params(rate="10 Mb/s"))


@pytest.fixture
def recorded(tmp_path):
    """A rule of the recorded rate of 100 kb/s from a to b, and 50 kb/s to c."""
    path = tmp_path / "rates.csv"
    path.write_text("time_s,source,destination,rate_kbps\n0,a,b,100\n0,a,c,50\n")
    return lambda **scope: ruled("recorded_rate", file=str(path), **scope)


def arrivals(model, rule, *sends):
    """(at ms, label) of frames of 1250 B from a to b, sent at times in ns."""
    bench = Bench(model, PLACES, rules=[rule])
    for label, time_ns in enumerate(sends):
        bench.send(time_ns, "a", "b", 1250, label=label)
    return [(time_ns / MS, label) for time_ns, label, *_, fate in bench.run()
            if fate == "arrived"]


def leaves_in_order(rule):
    """Twelve frames of 100 ms each wait when the window ends at 500 ms; another one is sent 0.5 ms
    later. The link needs 1 ms for each."""
    found = arrivals(link(), rule, *[0] * 12, 500 * MS + MS // 2)
    assert [label for _, label in found] == [*range(13)]
    at_ms = [time_ms for time_ms, _ in found]
    assert at_ms[:4] == pytest.approx([101, 201, 301, 401], abs=0.1)
    assert [time_ms - at_ms[4] for time_ms in at_ms[4:]] == pytest.approx([*range(9)])
    assert at_ms[4] == pytest.approx(501, abs=0.1)


def test_what_waits_for_bandwidth_leaves_at_the_end_at_the_rate_of_the_link():
    leaves_in_order(bandwidth(until="500 ms"))


def test_what_waits_for_a_recorded_rate_does_so_too(recorded):
    leaves_in_order(recorded(until="500 ms"))


@pytest.mark.parametrize("name", ["bandwidth", "recorded_rate"])
def test_the_twin_a_rule_that_is_no_queue_keeps_what_waits(monkeypatch, recorded, name):
    monkeypatch.setattr(scoped_rule, "ScopedQueue", Scoped)
    with pytest.raises(AssertionError):
        leaves_in_order((bandwidth if name == "bandwidth" else recorded)(until="500 ms"))


def test_who_sends_at_the_very_end_is_behind_what_waits():
    found = arrivals(ImmediateNetwork(), bandwidth(until="150 ms"), 0, 0, 0, 150 * MS)
    assert [label for _, label in found] == [0, 1, 2, 3]
    assert [time_ms for time_ms, _ in found][1:] == [150, 150, 150]


def test_each_window_begins_with_an_empty_queue():
    """Three of four wait when the first window ends; the next one begins at 200 ms."""
    found = arrivals(ImmediateNetwork(), bandwidth(until="150 ms", every="200 ms"),
                     0, 0, 0, 0, 200 * MS, 200 * MS)
    assert [time_ms for time_ms, _ in found] == pytest.approx([100, 150, 150, 150, 300, 350],
                                                              abs=0.1)


def test_a_broadcast_waits_for_each_receiver_as_long_as_its_link_takes(recorded):
    """100 ms to b and 200 ms to c, of which the end of the window cuts off 50 ms."""
    bench = Bench(link(), PLACES, rules=[recorded(until="150 ms")])
    for label in range(2):
        bench.send(0, "a", ["b", "c"], 1250, label=label, broadcast=True)
    found = [(time_ns / MS, label, to) for time_ns, label, _, to, _ in bench.run()]
    assert sorted(found) == [(101, 0, "b"), (151, 0, "c"), (151, 1, "b"), (151, 1, "c")]
    assert found.index((151, 0, "c")) < found.index((151, 1, "c"))


def test_what_waits_on_a_host_that_stops_is_lost():
    bench = Bench(link(), PLACES, rules=[bandwidth(until="150 ms")])
    for label in range(3):
        bench.send(0, "a", "b", 1250, label=label)
    bench.book(120 * MS, lambda _: bench.medium.flights.up.__setitem__(0, False), None)
    bench.run(110 * MS)
    assert bench.medium.in_flight() == 2
    assert [fate for *_, fate in bench.run()] == ["arrived", "sender_down", "sender_down"]
    assert bench.medium.in_flight() == 0
    assert bench.medium.packets_dropped == {"sender_down": 2}


def test_its_wait_is_a_part_of_a_frames_time_before_those_of_the_model():
    bench = Bench(link(), PLACES, rules=[bandwidth(until="50 ms")], passages=Passages())
    bench.send(0, "a", "b", 1250)
    bench.run()
    ((*_, total_ns, stamps),) = bench.spent
    assert [(stamp.part.value, stamp.time_ns) for stamp in stamps] == [
        ("rules", 50 * MS), ("airtime", MS)]
    assert total_ns == 51 * MS


def made(rule, until_ns):
    """The times (ms) at which a node makes a datagram of 64 full packets, every 100 ms if it does
    not wait because its send buffer is full (212 992 B, as in Linux)."""
    def begin(node):
        def send(_):
            times_ms.append(net.kernel.now_ns // MS)
            node.host.sockets.named("own").send(
                net.medium, (1,), 64 * FULL_PACKET_BYTES, 64, False, Carrier(), None, 64, node.name)
        node.timer(10, send, "zero")

    times_ms = []
    net = Net({"a": begin, "b": silent}, link(), rules=[rule])
    net.run(until_ns)
    return times_ms


def test_a_publisher_that_waits_for_its_send_buffer_is_woken_at_the_end():
    """A datagram takes 7.8 s at 100 kb/s and 78 ms on the link. Two fill the buffer; the third
    waits until 2 s."""
    assert made(bandwidth(until="2 s"), 2200 * MS) == [0, 100, 200, 2000, 2100]


def test_the_twin_a_rule_that_is_no_queue_wakes_nobody(monkeypatch):
    monkeypatch.setattr(scoped_rule, "ScopedQueue", Scoped)
    with pytest.raises(AssertionError):
        test_a_publisher_that_waits_for_its_send_buffer_is_woken_at_the_end()


def test_a_scope_that_does_not_end_keeps_the_publisher_waiting_for_the_queue():
    assert made(bandwidth(hosts=["a"]), 2 * S) == [0, 100, 200]


def test_links_out_of_the_scope_take_no_carrier_away():
    """Down for an hour or so from the beginning on, but only from 1 s until 2 s."""
    rule = ruled("flapping", hosts=["a"], up="1 ms", down="1 h", **{"from": "1 s"}, until="2 s")
    bench, seen = Bench(ImmediateNetwork(), PLACES, rules=[rule]), []
    for at_s in (0.5, 1.5, 2.5):
        bench.book(round(at_s * S), lambda _: seen.append((rule.carrier(0), rule.carrier(1)[0])),
                   None)
    bench.run(3 * S)
    assert [(up, other) for (up, _), other in seen] == [(True, True), (False, True), (True, True)]
    assert [changes_ns for (_, changes_ns), _ in seen[:2]] == [S, 2 * S]
