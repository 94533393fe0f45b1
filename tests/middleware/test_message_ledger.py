"""The parts of messages' time over the transports of ``direct``."""

from graphs import MS, Net, listener, silent, talker
from ledgers import rows_of, stamps_of

from desim import ports
from desim.middleware.message_ledger import MessageLedger
from desim.network.passages import Passages
from desim.testing import ImmediateNetwork
from netmodels.ideal import Ideal
from netmodels.switch import Switch


def played(nodes, model=None, rules=(), until_ns=2000 * MS):
    ledger = MessageLedger(Passages())
    net = Net(nodes, model, rules, ledger=ledger).run(until_ns)
    net.graph.catch_up()
    return ledger


def test_a_message_waits_in_the_outbox_for_the_one_before():
    says = [(MS, "first"), (2 * MS, "second")]
    ledger = played({"a": talker(says), "b": listener([])}, Ideal(Ideal.Params(delay="5 ms")))
    assert stamps_of(ledger) == [[("propagation", "a", 5 * MS)],
                                 [("sender's queue", "a", 4 * MS), ("propagation", "a", 5 * MS)]]


class Once(ImmediateNetwork):
    """A model that loses these packets of the first frame (None: all of it), and nothing else."""

    reasons = ("spilt",)

    def __init__(self, lost):
        self._lost = [ports.Drop("spilt", lost)]

    def send(self, frame):
        if not self._lost:
            return 5
        drop = self._lost.pop()
        self._context.settle(frame, frame.receivers[0], drop)
        return None if drop.packets is None else 5


def test_a_lost_packet_costs_the_time_until_it_is_sent_again():
    for lost in ((0,), (1,), None):
        ledger = played({"a": talker([(MS, "word")], size_bytes=4000), "b": listener([])},
                        Once(lost))
        (parts,), (row,) = stamps_of(ledger), rows_of(ledger)
        assert [part for part, *_ in parts] == ["retransmission", "on the medium"]
        assert parts[1] == ("on the medium", "a", 5)
        assert sum(time_ns for *_, time_ns in parts) == row["end_ns"] - row["born_ns"]
        # A later packet shows the loss; else it is Linux's tail loss probe, two whole ticks of 4 ms
        # after the transmission at 1 ms.
        assert parts[0][2] == {(0,): 10, (1,): 10, None: 11 * MS}[lost]


def test_dropped_messages_have_a_place():
    says = [(k * MS, f"word {k}") for k in range(1, 5)]
    ledger = played({"a": talker(says), "b": listener([])}, Ideal(Ideal.Params(delay="9 ms")))
    dropped = [row for row in rows_of(ledger) if row["fate"]]
    assert {(ledger.reasons[row["fate"]], row["medium"], row["host"])
            for row in dropped} == {("outbox_full", -1, 0)}
    full = Switch(Switch.Params(rate="1 Mb/s", buffer="0 B"))
    nodes = {name: talker([(MS, name)], size_bytes=1000, transport="datagram") for name in "abc"}
    ledger = played(nodes | {"d": listener([])}, full)
    lost = [row for row in rows_of(ledger) if row["fate"]]
    assert {(ledger.reasons[row["fate"]], row["medium"], row["host"])
            for row in lost} == {("queue_full", 0, 3)}
    ledger = played({"a": talker([(MS, "word")], transport="datagram", via="broadcast"),
                     "b": listener([]), "c": silent})
    assert [row["fate"] for row in rows_of(ledger)] == [0]
