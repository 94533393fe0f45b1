"""DDS writers that keep all samples: a full history blocks who publishes, at most 100 ms."""

import pytest
from ddsnets import conserved, dds, partition
from graphs import MS, Net, S, silent

from desim.middleware.contents import Filler
from desim.middleware.dds.blocked_calls import BlockedCalls

CUT_S, MOST = 3, 10


def hearing(log):
    def begin(node):
        node.subscribe("/t", lambda message: log.append((node.now_ns, message.seq)), queue=0)
    return begin


def ticking(log, rate_hz=50, size_bytes=1000, begin_s=1, also=None):
    """A node that publishes at each tick from then on, and logs the ticks in ms."""
    def begin(node):
        node.advertise("/t", queue=0)
        if also:
            node.advertise(also, queue=5)

        def tick(k):
            log.append(node.now_ns / MS)
            node.publish("/t", Filler(size_bytes))
            if also:
                node.publish(also, Filler(10))

        node.after(begin_s * S, lambda _: node.timer(rate_hz, tick, "zero"))
    return begin


def cut_off(preset="fastdds", seconds=2, costs=None, **params):
    """A writer whose reader is cut off from 3 s on, and the times of its ticks."""
    ticks, heard = [], []
    net = Net({"a": ticking(ticks), "b": hearing(heard)},
              rules=[partition(f"{CUT_S} s", f"{CUT_S + seconds} s")],
              middleware=dds(preset, max_samples=MOST, **params), costs=costs)
    return net, ticks, heard


def assert_calls_last_100_ms(limit="100 ms"):
    """50 Hz: the ten samples of 3 s to 3.18 s fill the history. From then on each call takes 100 ms
    and is refused, and of the ticks meanwhile one is made up for."""
    net, ticks, _ = cut_off(max_blocking_time=limit)
    net.run(4 * S + 50 * MS)
    late = [at_ms for at_ms in ticks if at_ms >= 1000 * CUT_S]
    assert late == [3000 + 20 * k for k in range(MOST)] + [3200 + 100 * k for k in range(9)]
    counts = net.counts("/t")
    assert counts.dropped == {"history_full": 8}
    assert conserved(net, "/t")


def test_calls_last_100_ms_and_are_refused():
    assert_calls_last_100_ms()


@pytest.mark.parametrize("twin", ["shorter", "nobody waits"])
def test_with_another_time_or_without_waiting_they_do_not(monkeypatch, twin):
    if twin == "nobody waits":
        monkeypatch.setattr(BlockedCalls, "hold",
                            lambda self, call: call.writer.write(*call[1:], 0))
    with pytest.raises(AssertionError):
        assert_calls_last_100_ms("90 ms" if twin == "shorter" else "100 ms")


@pytest.mark.parametrize("preset", ["fastdds", "cyclonedds"])
def test_after_a_short_cut_a_call_goes_on_and_nothing_is_lost(preset):
    """The eleventh sample finds no room at 3.2 s. The reader is back 20 ms later and answers the
    next heartbeat; with half a second to wait, the call succeeds."""
    net, ticks, heard = cut_off(preset, 0.22, max_blocking_time="30 s", heartbeat_period="100 ms")
    net.run(8 * S)
    blocked = max(after - before for before, after in zip(ticks, ticks[1:], strict=False))
    assert 20 < blocked < 500
    assert [seq for _, seq in heard] == [*range(1, len(heard) + 1)]
    counts = net.counts("/t")
    assert not counts.dropped and conserved(net, "/t")


def test_of_cyclone_the_limit_is_in_bytes():
    """Samples of 1000 B: 501 of them, as a call that finds 500 kB or less goes on."""
    ticks = []
    net = Net({"a": ticking(ticks, 1000), "b": hearing([])}, rules=[partition("3 s", "9 s")],
              middleware=dds("cyclonedds")).run(4 * S)
    writer, = net.graph.middleware._writers[0]["/t"]
    assert [link.unacknowledged() for link in writer.links().values()] == [501]
    assert [after - before for before, after in zip(ticks[-6:], ticks[-5:], strict=False)] == [
        100] * 5
    assert conserved(net, "/t")


def test_what_the_callback_publishes_behind_it_comes_later():
    """Another topic of the same node: its message of the tick at 3.2 s leaves when that call has
    returned, at 3.3 s, and reaches nobody before."""
    reads = []
    nodes = {"a": ticking([], also="/u"), "b": hearing([]),
             "c": lambda node: node.subscribe("/u", lambda message: reads.append(
                 node.now_ns / MS), queue=0)}
    Net(nodes, rules=[partition("3 s", "9 s")],
        middleware=dds("fastdds", max_samples=MOST)).run(3590 * MS)
    assert [round(at) for at in reads if at > 3150] == [3160, 3180, 3300, 3400, 3500]


def test_on_a_busy_computer_the_callback_lasts_as_long():
    class Costs:
        def callback_ns(self, work):
            return 5 * MS * (work.node == "node")

        def send_ns(self, topic, size_bytes, links):
            return 0

        def receive_ns(self, topic, size_bytes):
            return 0

    net, ticks, _ = cut_off(costs=Costs())
    net.run(4 * S)
    late = [at_ms for at_ms in ticks if at_ms >= 3190]
    assert len(late) < 12 and min(b - a for a, b in zip(late[1:], late[2:], strict=False)) >= 100
    assert net.counts("/t").dropped["history_full"] >= 6
    assert conserved(net, "/t")


def test_a_host_that_stops_in_a_call_loses_its_message():
    net, ticks, _ = cut_off()
    net.at(3250 * MS, net.graph.host("a").stop)
    net.at(3500 * MS, net.graph.host("a").start)
    net.run(7 * S)
    assert net.counts("/t").dropped["sender_down"] >= 1
    assert conserved(net, "/t")
    assert any(at_ms > 4500 for at_ms in ticks)


def test_the_slowest_reader_counts():
    """Two readers, one of which is cut off."""
    ticks = []
    net = Net({"a": ticking(ticks), "b": hearing([]), "c": hearing([]), "d": silent},
              rules=[partition("3 s", "9 s")],
              middleware=dds("fastdds", max_samples=MOST)).run(3590 * MS)
    assert net.counts("/t").dropped == {"history_full": 2 * 3}
    assert len(ticks) == 100 + MOST + 4
    assert conserved(net, "/t")
