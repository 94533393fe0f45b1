"""The account of arrivals equals what a plain loop over the messages makes of them."""

from collections import Counter

import numpy as np
import pytest
from graphs import MS, Net, S, silent
from hypothesis import given
from hypothesis import strategies as st

from desim.middleware import arrivals as module
from desim.middleware.counts import EDGES_NS
from desim.middleware.message import Message

HOSTS, TOPICS = ("a", "b", "c"), ("/map", "/pose")
# Topic, source, receiver, bytes, the time of birth and the latency.
DELIVERIES = st.lists(st.tuples(st.sampled_from(TOPICS), st.integers(0, 2), st.integers(0, 2),
                                st.integers(0, 10**6), st.integers(0, 5 * S),
                                st.one_of(st.just(0), st.integers(0, 10**13))), max_size=60)


class Content:
    size_bytes = 1


def entered(deliveries):
    """A network after messages with these fates were noted and entered."""
    net = Net(dict.fromkeys(HOSTS, silent), on_fate=None)
    graph = net.graph
    for number, (topic, source, receiver, size, born_ns, latency_ns) in enumerate(deliveries):
        message = Message(graph.hosts[source], graph.topic(topic), number, size, born_ns, Content)
        graph.arrivals.note(message, graph.hosts[receiver], born_ns + latency_ns, born_ns, born_ns)
    graph.catch_up()
    return net


def conforms(deliveries):
    """Whether rows, tallies and last arrivals are those of a plain loop."""
    net = entered(deliveries)
    rows, last_ns = [], np.zeros((3, 3), np.int64)
    counts, sizes, latencies = Counter(), Counter(), Counter()
    for number, (topic, source, receiver, size, born_ns, latency_ns) in enumerate(deliveries):
        counts[topic] += 1
        sizes[topic] += size
        latencies[topic, int(np.searchsorted(EDGES_NS, latency_ns, side="right"))] += 1
        last_ns[source, receiver] = max(last_ns[source, receiver], born_ns + latency_ns)
        rows.append((born_ns + latency_ns, "delivered", HOSTS[receiver], HOSTS[source], number,
                     latency_ns))
    topics = net.graph.topics
    return (sorted(net.rows("delivered")) == sorted(rows)
            and (net.graph.arrivals.last_ns == last_ns).all()
            and {name: topic.counts.delivered for name, topic in topics.items()} == counts
            and {name: topic.counts.bytes for name, topic in topics.items()} == sizes
            and {(name, bin_): int(topic.counts.latencies[bin_]) for name, topic in topics.items()
                 for bin_ in np.flatnonzero(topic.counts.latencies).tolist()} == latencies)


@given(DELIVERIES)
def test_the_account_is_that_of_a_plain_loop(deliveries):
    assert conforms(deliveries)


@pytest.mark.parametrize("wrong", [
    lambda delivered: delivered["seq"].__setitem__(0, 99),
    lambda delivered: delivered["size_bytes"].__setitem__(0, 99),
    lambda delivered: delivered["receiver"].__setitem__(0, 2),
    lambda delivered: delivered["arrived_ns"].__setitem__(0, 7 * MS)])
def test_one_wrong_field_shows(wrong, monkeypatch):
    """The twin."""
    deliveries = [("/map", 0, 1, 100, S, 5 * MS), ("/pose", 1, 2, 7, 2 * S, 0)]
    assert conforms(deliveries)
    enter = module._enter

    def entering(delivered, *rest):
        delivered = delivered.copy()
        wrong(delivered)
        enter(delivered, *rest)

    monkeypatch.setattr(module, "_enter", entering)
    assert not conforms(deliveries)
