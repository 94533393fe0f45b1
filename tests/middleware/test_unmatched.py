"""Messages that are published while nobody is matched have an account of their own.

It is the same under every middleware: published = delivered + dropped + unmatched + waiting, by
topic.
"""

import pytest
from graphs import MS, Net, S, Words, listener, silent, talker

from desim.middleware.dds.dds import Dds
from desim.middleware.direct import Direct
from desim.middleware.multimaster.multimaster import Multimaster
from desim.middleware.ros1.ros1 import Ros1
from desim.middleware.topics import Publisher
from desim.middleware.zenoh.zenoh import Zenoh
from netmodels.ideal import Ideal
from netmodels.rules.partition import Partition

MIDDLEWARE = {
    "direct": lambda: Direct(),
    "ros1": lambda: Ros1(Ros1.Params(master="a")),
    "multimaster": lambda: Multimaster(Multimaster.Params()),
    "fastdds": lambda: Dds(Dds.Params(preset="fastdds")),
    "cyclonedds": lambda: Dds(Dds.Params(preset="cyclonedds")),
    "zenoh": lambda: Zenoh(Zenoh.Params(preset="zenoh")),
}
SAID = 600  # ten a second for a minute


def speaks(node):
    node.advertise("/talk", queue=5)
    node.timer(10, lambda k: k < SAID and node.publish("/talk", Words("w", 100)), start="zero")


def played(name):
    """One speaks, two listen; b is cut off for a while."""
    net = Net({"a": speaks, "b": listener([]), "c": listener([])},
              Ideal(Ideal.Params(delay="1 ms")),
              [Partition(Partition.Params(groups=[["b"]], **{"from": "20 s", "until": "45 s"}))],
              middleware=MIDDLEWARE[name]())
    return net.run(61 * S)


def account(net, topic="/talk"):
    counts = net.counts(topic)
    return counts.delivered + sum(counts.dropped.values()) + counts.unmatched + net.waiting()


@pytest.mark.parametrize("name", MIDDLEWARE)
def test_everything_published_is_accounted_for(name):
    net = played(name)
    assert net.counts("/talk").published == account(net) == 2 * SAID
    unmatched = net.counts("/talk").unmatched
    assert unmatched == 0 if name == "direct" else unmatched > 0


@pytest.mark.parametrize("name", MIDDLEWARE)
def test_hosts_that_stop_and_start_are_accounted_for(name):
    """While c does not run nobody listens there; a publisher that does not know says it to a
    ghost."""
    net = Net({"a": speaks, "c": listener([])}, Ideal(Ideal.Params(delay="1 ms")),
              middleware=MIDDLEWARE[name]())
    net.at(20 * S + MS, net.graph.host("c").stop)
    net.at(40 * S + MS, net.graph.host("c").start)
    net.run(61 * S)
    counts = net.counts("/talk")
    assert counts.published == account(net)
    assert SAID - 200 <= counts.published <= SAID
    assert counts.published == SAID - 200 or name != "direct"


@pytest.mark.parametrize("name", MIDDLEWARE)
def test_what_a_latched_topic_says_again_is_not_lost(name):
    """The last message goes to whom the publisher meets later; the first one nobody ever gets."""
    net = Net({"a": talker([(0, "one"), (MS, "two")], latch=True), "b": listener([]), "c": silent},
              Ideal(Ideal.Params(delay="1 ms")), middleware=MIDDLEWARE[name]()).run(30 * S)
    counts = net.counts("/talk")
    assert (counts.delivered, counts.unmatched) == ((2, 0) if name == "direct" else (1, 1))
    assert counts.published == account(net) == 2


def unseen(net):
    """The messages of a, ten a second, for each host that it does not know of then."""
    said = {"b": 0, "c": 0}
    for host in said:
        known = [(row[0], row[4] == "online") for row in net.rows("sees")
                 if row[2:4] == ("a", host)]
        for k in range(SAID):
            said[host] += not any([now for at, now in known if at <= k * S // 10][-1:])
    return sum(said.values())


@pytest.mark.parametrize(("preset", "missed"), [("fastdds", 56), ("cyclonedds", 181)])
def test_dds_says_it_to_nobody_from_the_end_of_a_lease_until_they_meet_again(monkeypatch, preset,
                                                                             missed):
    """Cut off from 20 s to 45 s. A writer of Fast DDS forgets b when its lease of 20 s ends, and
    knows it again with its next announcement; one of Cyclone DDS after 10 s, and 3 s later. Until
    then samples wait in the writer's history and are overwritten. The twin's lease outlasts the
    cut."""
    net = played(preset)
    assert net.counts("/talk").unmatched == unseen(net) == missed + 3  # and at the start
    monkeypatch.setitem(MIDDLEWARE, "patient",
                        lambda: Dds(Dds.Params(preset=preset, lease="60 s")))
    patient = played("patient")
    assert patient.counts("/talk").unmatched == unseen(patient) == 3


def test_the_twin_does_not_see_who_listens(monkeypatch):
    monkeypatch.setattr(Publisher, "_missed", lambda self: [])
    net = played("zenoh")
    assert net.counts("/talk").published < 2 * SAID
