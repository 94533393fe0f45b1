"""A broadcast that arrives at all of its receivers at once, beside one that does so one by one."""

import numpy as np
import pytest
from graphs import MS, Net, S, Words
from hypothesis import given, settings
from hypothesis import strategies as st

from desim.middleware.datagrams import Datagram
from desim.middleware.topics import WaitSet
from desim.network.carrier import Carrier
from desim.network.surroundings import Still
from netmodels.ideal import Ideal
from netmodels.radio.dcf.stations import Stations
from netmodels.radio.radio import Radio
from netmodels.rules.loss import Loss

HOSTS = [f"h{i}" for i in range(7)]


def gossip(heard):
    """Software that says things in common instants; some of what it hears makes it speak again.
    Every third host has two callbacks, every fourth keeps the latest message beside its callback,
    one does only that, and one is deaf."""
    def begin(node):
        number = int(node.host.name[1:])
        node.advertise("/talk", transport="datagram", via="broadcast")
        node.timer(20, lambda k: node.publish("/talk", Words(f"{node.host.name} {k}", 60)), "zero")
        if number == 5:
            return
        if number == 6:
            waiting = WaitSet()
            node.latest("/talk", waiting)
            node.timer(30, lambda k: heard.extend(
                (node.now_ns, message.content.text) for _, message in waiting.news()), "zero")
            return

        def hear(message):
            heard.append((node.now_ns, node.host.name, message.content.text))
            if number % 2 and not message.content.text.endswith("again"):
                node.publish("/talk", Words(f"{node.host.name} again", 40))

        node.subscribe("/talk", hear, queue=2 if number < 4 else 0)
        if number % 3 == 0:
            node.subscribe("/talk", lambda message: heard.append((node.host.name, "too")))
        if number % 4 == 0:
            node.latest("/talk")
    return begin


def played(model, faults=(), rules=()):
    heard = []
    net = Net(dict.fromkeys(HOSTS, gossip(heard)), model, rules)
    for time_ns, name, up in faults:
        host = net.graph.host(name)
        net.at(time_ns, host.start if up else host.stop)
    net.run(S)
    counts = net.counts("/talk")
    return (heard, sorted(net.rows()), sorted(net.fates), net.trace.digest(), net.medium.intended,
            net.medium.delivered, list(net.medium.rx_bytes), counts.bytes, counts.delivered,
            counts.queued, counts.called, counts.overwritten, counts.discarded,
            counts.latencies.tolist(),
            [host.last_arrival_ns.tolist() for host in net.graph.hosts])


MODELS = [lambda: Ideal(Ideal.Params()), lambda: Ideal(Ideal.Params(delay="1 ms")),
          lambda: Radio.build(Radio.Params(path_loss={"model": "fixed", "total": "60 dB"}))]
FAULTS = st.lists(st.tuples(st.integers(0, 20).map(lambda k: k * 50 * MS + k % 2),
                            st.sampled_from(HOSTS), st.booleans()), max_size=6)


@settings(max_examples=30, deadline=None)
@given(st.sampled_from(MODELS), FAULTS, st.sampled_from([0, 30]))
def test_all_receivers_at_once_are_one_after_the_other(model, faults, loss_percent):
    def play():
        rules = [Loss(Loss.Params(probability=f"{loss_percent} %"))] if loss_percent else []
        return played(model(), faults, rules)

    at_once = play()
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Datagram, "arrived_many", Carrier.arrived_many)
        assert play() == at_once


def test_the_twin_that_wakes_hosts_in_another_order_is_noticed(monkeypatch):
    at_once = played(MODELS[1]())
    assert at_once[4] > 1000 and at_once[11] > 0
    arrived_many = Datagram.arrived_many
    monkeypatch.setattr(Datagram, "arrived_many", lambda self, message, receivers:
                        arrived_many(self, message, receivers[::-1]))
    assert played(MODELS[1]())[0] != at_once[0]


def test_a_broadcast_of_one_packet_is_settled_as_a_longer_one_is(monkeypatch):
    """Hosts stand about: some miss a packet, and some hear others at the same time."""
    def play():
        heard = []
        places = Still(np.random.default_rng(1).uniform(0, 500, (len(HOSTS), 2)))
        net = Net(dict.fromkeys(HOSTS, gossip(heard)),
                  Radio.build(Radio.Params(broadcast_rate="24 Mb/s")), place=places)
        net.run(2 * S)
        return heard, sorted(net.rows()), net.medium.dropped

    short = play()
    assert {"channel_error", "collision", "out_of_reach"} <= set(short[2])
    monkeypatch.setattr(Stations, "ended_broadcast", lambda stations: [])
    assert play() == short
