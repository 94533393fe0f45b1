"""Repairs of Fast DDS's discovery: one timer for all requests, and heartbeats between the items."""

from types import SimpleNamespace

import pytest
from configured import configured
from graphs import Net, S, silent

from desim.middleware.dds import endpoint_repairs
from desim.middleware.dds.dds import Dds
from desim.middleware.dds.endpoint_repairs import TRAIN, SharedRepairs
from desim.middleware.dds.parameters import DdsConstants
from desim.middleware.dds.wire import FASTDDS, DataKind, DiscoveredData

ITEMS = [DiscoveredData((0, 1, 0), kind, f"/t{k}", 500)
         for kind in (DataKind.READER, DataKind.WRITER) for k in range(10)]


class Writer:
    """A participant and its endpoints, as their repairs see both: what was sent, and what waits."""

    def __init__(self, readers, resent_bytes):
        self.constants, self.dds = DdsConstants(), SimpleNamespace(wire=FASTDDS)
        self.readers = [SimpleNamespace(number=k, out=ITEMS, requested=())
                        for k in range(readers)]
        self.resent_bytes = resent_bytes
        self.calls, self.items, self.beats = [], [], []
        self.repairs = SharedRepairs(self, self)

    def direct(self):
        return self.readers

    def after(self, delay_ns, fn, arg=None):
        self.calls.append((delay_ns, fn))

    def send_items(self, to, numbers, messages, known):
        assert sum(message.items for message in messages) == len(numbers)
        self.items.append(([one.number for one in to], list(numbers), len(messages)))

    def send_heartbeats(self, to, count, *, directed):
        self.beats.append((len(to), count, directed))

    def send_heartbeat_soon(self):
        pass

    def repair(self):
        (_, fn), self.calls = self.calls[0], []
        fn(None)


def test_a_request_leaves_the_timer_alone_that_runs():
    writer = Writer(2, 0)
    writer.repairs.request(writer.readers[0], (0, 1))
    writer.repairs.request(writer.readers[1], (1,))
    assert [delay_ns for delay_ns, _ in writer.calls] == [100_000]
    writer.repair()
    assert writer.items == [([0], [0], 1), ([0, 1], [1], 1)]
    writer.repairs.request(writer.readers[0], (1,))
    assert len(writer.calls) == 1


def sent_to(readers, wanted, resent_bytes):
    writer = Writer(readers, resent_bytes)
    writer.repairs.request(writer.readers[0], tuple(range(wanted)))
    writer.repair()
    return writer


def assert_that_trains_carry_as_many_heartbeats_as_items():
    writer = sent_to(30, 20, 10**6)  # it has sent more than a buffer: one behind each item
    assert writer.beats == [(30, 20, False)]
    # Writers come first; each item is a message.
    assert writer.items == [([0], list(range(10, 20)), TRAIN), ([0], list(range(10)), TRAIN)]


def test_heartbeats_between_items_reach_each_reader_in_one_train():
    assert_that_trains_carry_as_many_heartbeats_as_items()


def test_of_a_writer_that_sends_heartbeats_behind_every_other_item_they_do_not(monkeypatch):
    class Half(endpoint_repairs.Spent):
        def over(self, so_far_bytes):
            self.turn = not getattr(self, "turn", False)
            return self.turn

    monkeypatch.setattr(endpoint_repairs, "Spent", Half)
    with pytest.raises(AssertionError):
        assert_that_trains_carry_as_many_heartbeats_as_items()


def test_a_young_writer_puts_items_together_without_heartbeats():
    writer = sent_to(30, 20, 0)
    assert writer.beats == [(30, 0, False)]
    assert writer.items == [([0], [*range(10, 20), *range(10)], 2)]


@pytest.mark.parametrize(("lost", "answered"), [((), 5), ((0, 3), 3), ((4,), 4)])
def test_only_heartbeats_that_arrive_are_answered(lost, answered):
    net = Net({f"robot_{k}": silent for k in range(2)},
              middleware=Dds(configured(Dds.Params, preset="fastdds"))).run(5 * S)
    me = net.graph.middleware.participants[0]
    (remote,) = me.remotes.values()
    frames = net.graph.context.discovery_bytes["sedp_acknack"]
    me.endpoints.heartbeats(remote, lost, remote.received_series, remote.known, 5, False)
    net.run(6 * S)
    assert net.graph.context.discovery_bytes["sedp_acknack"] - frames == \
        FASTDDS.acknacks(answered).size_bytes
