"""The memory of hosts whose callbacks take time, shown by small whole logs."""

import pytest
from graphs import MS, Net, S, listener, silent, talker

from desim.errors import ModelError
from netmodels.access_link import AccessLink


class Bytes:
    """Callbacks take 10 ms, and a process has what its node keeps, beside a system of 100 B."""

    def callback_ns(self, work):
        return 10 * MS

    def send_ns(self, topic, size_bytes, links):
        return 0

    def receive_ns(self, topic, size_bytes):
        return 0

    def system_bytes(self):
        return 100

    def process_bytes(self, kept):
        return kept.quantities["bytes"] + 10 * kept.quantities.get("scans", 0)


def hoards(hz, most=10**9):
    """Starts a node that keeps one scan more with each tick of a timer."""
    def begin(node):
        scans = []
        node.timer(hz, lambda k: scans.append(k) if len(scans) < most else None, "zero")
        node.kept = lambda: {"scans": len(scans)}
    return begin


def killed(memory_bytes, costs=None, stops=True, **nodes):
    """The rows of a host whose software starts again a second after it has run out of memory."""
    net = Net({"robot": nodes}, costs=costs or Bytes(), memory_bytes=memory_bytes, processors=4)
    host = net.graph.host("robot")

    def start_later(*_):
        net.at(net.kernel.now_ns, host.stop)
        net.at(net.kernel.now_ns + S, host.start)
    net.graph.listeners["out_of_memory"] = start_later if stops else lambda *_: None
    net.run(5 * S)
    return host, [(row[0] // MS, *row[3:]) for row in net.rows("out_of_memory")]


def test_the_largest_process_dies_at_the_call_that_takes_too_much_and_starts_empty():
    host, rows = killed(150, slam=hoards(10), tf=hoards(10, most=1))
    # Five scans are 150 B beside the 100 B of the system and 10 B of tf: one too many at 400 ms.
    assert rows == [(400, "slam", 160, 150), (1800, "slam", 160, 150), (3200, "slam", 160, 150),
                    (4600, "slam", 160, 150)]
    assert host.memory.kills == ["slam"] * 4
    assert host.memory.used_bytes() == 0  # it is down


def test_memory_that_is_enough_to_the_byte_kills_nobody():
    host, rows = killed(160, slam=hoards(10, most=5), tf=hoards(10, most=1))
    assert not rows
    assert host.memory.used_bytes() == 160
    assert host.memory.of_processes() == {"slam": 50, "tf": 10}


def test_one_host_dies_once_until_it_has_stopped():
    _, rows = killed(150, stops=False, slam=hoards(10))
    assert rows == [(500, "slam", 160, 150)]


def test_without_a_limit_or_a_model_of_memory_there_is_none():
    class Times:
        callback_ns, send_ns, receive_ns = Bytes.callback_ns, Bytes.send_ns, Bytes.receive_ns
    assert not killed(None, slam=hoards(10))[1]
    assert killed(1, costs=Times(), slam=hoards(10))[0].memory is None


class BusyMind(Bytes):
    """Only callbacks of ``mind`` take time."""

    def callback_ns(self, work):
        return 10 * MS if work.node == "mind" else 0


def test_messages_that_wait_for_a_callback_are_kept_by_their_receiver():
    words = [(k * MS, "word") for k in range(5)]
    net = Net({"robot": {"mouth": talker(words, queue=0), "mind": lambda node: node.subscribe(
        "/talk", lambda message: None, queue=3)}}, costs=BusyMind())
    host = net.graph.host("robot")
    net.run(2 * MS)  # the first is being read, of 100 B as each
    assert host.waiting_bytes("mind") == 200
    assert host.waiting_bytes("mouth") == 0
    net.run(9 * MS)
    assert host.waiting_bytes("mind") == 300
    assert host.memory.used_bytes() == 100 + 300
    net.run(S)
    assert host.waiting_bytes("mind") == 0


def test_messages_that_have_not_arrived_are_kept_by_their_sender_for_each_link():
    net = Net({"a": talker([(0, "one"), (1 * MS, "two")], queue=0), "b": silent,
               **{name: listener([], queue=0) for name in "cd"}},
              AccessLink(AccessLink.Params(rate="1 Mb/s", latency="20 ms")), costs=BusyMind())
    net.run(2 * MS)
    assert net.graph.host("a").waiting_bytes("node") == 2 * 2 * 100
    net.run(S)
    assert net.graph.host("a").waiting_bytes("node") == 0


@pytest.mark.parametrize(("kept", "said"), [
    ({"scan": 1}, "node 'slam' keeps scan=1 (did you mean 'scans'?); known: bytes, cells, patches, "
                  "scans"),
    ({"scans": -1}, "node 'slam' keeps scans=-1; a quantity is an int >= 0")])
def test_what_is_kept_has_names_and_counts(kept, said):
    def begin(node):
        node.kept = lambda: kept
        node.timer(10, lambda k: None, "zero")
    with pytest.raises(ModelError) as error:
        killed(1000, slam=begin)
    assert str(error.value) == said


def test_a_model_of_memory_answers_in_bytes():
    class Halves(Bytes):
        def system_bytes(self):
            return 0.5
    with pytest.raises(ModelError, match="Halves.system_bytes .* answered 0.5; wanted: an "
                                         "int >= 0, in bytes"):
        killed(1000, costs=Halves(), slam=hoards(10))
