"""Networks of Zenoh routers to test with."""

from configured import configured
from graphs import Net, S

from desim.middleware.zenoh.zenoh import Zenoh
from netmodels.access_link import AccessLink
from netmodels.rules.partition import Partition

# A lease of 10 s; nodes declare at once.
QUICK = {"preset": "zenoh", "scout_jitter": "0 s", "open_wait": "0 s"}


def zenoh(**params):
    """With timers that are exact and addresses that are known."""
    params["tcp"] = {"tick": "0 ns", "arp": "static"} | params.get("tcp", {})
    return Zenoh(configured(Zenoh.Params, **{**QUICK, **params}))


def link(**params):
    return AccessLink(AccessLink.Params(**{"rate": "1 Gb/s", "latency": "1 ms", **params}))


def partition(start, until, *groups):
    return Partition(Partition.Params(groups=list(groups) or [["b"]],
                                      **{"from": start, "until": until}))


def net_of(nodes, model=None, rules=(), **params):
    return Net(nodes, model or link(), rules, middleware=zenoh(**params))


def sees(net, host=None):
    """(time in s, who, whom, how)."""
    return [(time_ns / S, who, whom, state) for time_ns, _, who, whom, state, _ in net.rows("sees")
            if host in (None, who)]


def control(net, *kinds):
    return [row for row in net.rows("control") if row[4] in kinds]


def mesh(net):
    """The number of links that each host has open."""
    return [len(net.graph.middleware._routers[host].links) for host in range(len(net.graph.hosts))]


def conserved(net):
    """Each message at each receiver is delivered, dropped or waits."""
    for topic in net.graph.topics.values():
        counts = topic.counts
        waiting = sum(publisher.transport.waiting() for publisher in topic.publishers)
        assert counts.intended == counts.delivered + sum(counts.dropped.values()) + waiting
    seen = [(number, host) for number, host, *_ in net.fates]
    assert len(seen) == len(set(seen)), "a message met two fates at one host"
