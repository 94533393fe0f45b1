"""The age of the scan on which a command is based, by hand. Times are in ms."""

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
import pytest
from graphs import MS, Net, Words, talker
from ledgers import table_of_net

from desim.errors import InputError
from desim.results.data_age import DataAge
from desim.results.why import Query, breakdown
from netmodels.ideal import Ideal


class Costs:
    """A tick of move_base takes 30 ms."""

    def callback_ns(self, work):
        return 30 * MS * (work.node == "move_base")

    def send_ns(self, topic, size_bytes, links):
        return 0

    def receive_ns(self, topic, size_bytes):
        return 0


def commands(costs):
    """The ledger of 240 ms with a scan every 100 ms from 1 on, and a command at each tick of 20 Hz;
    each is under way for 5 ms."""
    def move_base(node):
        scan = node.latest("/scan")
        node.advertise("/cmd_vel", queue=0)
        node.timer(20, lambda k: (scan.read(), node.publish("/cmd_vel", Words(str(k)))), "zero",
                   name="control")
    base = {"laser": talker([(time * MS, "scan") for time in (1, 101, 201)], "/scan", queue=0),
            "motor": lambda node: node.subscribe("/cmd_vel", lambda message: None, queue=0)}
    return table_of_net(lambda ledger: Net(
        {"base": base, "robot": {"move_base": move_base}}, Ideal(Ideal.Params(delay="5 ms")),
        costs=costs, ledger=ledger).run(240 * MS))


def age(table):
    return breakdown(table, Query(topic="/cmd_vel", since="/scan")).age


# Called at 50 and 150, commands are based on the scans of 1 and 101, and arrive at 85 and 185;
# those called at 100 and 200 on the same, as the next ones arrive at 106 and 206. At 0 there was
# none.
BUSY = DataAge(4, 1, (84 + 134 + 84 + 134) / 4 * MS, 134 * MS, {
    "reading's way": 5 * MS, "unread": 44 * MS, "kept": 25 * MS, "callback": 30 * MS,
    "latency": 5 * MS})


def test_a_command_is_as_old_as_the_scan_that_was_read_for_it():
    assert age(commands(Costs())) == BUSY


def test_on_an_ideal_computer_it_leaves_at_once():
    found = age(commands(None))
    assert found.mean_ns == BUSY.mean_ns - 30 * MS and found.blind == 1
    assert found.parts_ns == BUSY.parts_ns | {"callback": 0}


def test_with_another_instant_of_the_call_it_is_another_age():
    """The twin of the first test: what is read while the command is computed is not its base."""
    table = commands(Costs())
    column = table.column_names.index("called_ns")
    later = pa.array(np.asarray(table["born_ns"]) + 25 * MS)
    assert age(table.set_column(column, "called_ns", later)) != BUSY


def test_a_command_before_the_first_scan_is_blind():
    table = commands(None)
    first = table.filter(pc.less(table["born_ns"], 40 * MS))
    assert len(first) == 2 and age(first) == DataAge(0, 1, 0.0, 0, {})


def test_an_unknown_topic_is_a_complaint():
    with pytest.raises(InputError, match=r"no message has the topic '/scam' \(did you mean '/sc"):
        breakdown(commands(None), Query(since="/scam"))
