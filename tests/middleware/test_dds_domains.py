"""DDS domains: who finds whom, what the others' announcements cost, ports."""

import pytest
from configured import configured
from ddsnets import conserved, dds
from graphs import Net, S, listener, silent, talker

from desim.errors import InputError
from desim.middleware.dds.dds import Dds
from desim.middleware.dds.domains import MOST_DOMAIN, last_port, multicast_port


def robots(count, preset="cyclonedds", **params):
    return Net({f"robot_{k}": silent for k in range(count)}, middleware=dds(preset, **params))


def halves(count):
    """The second half of ``count`` robots in domain 7, the first in 3."""
    return {"domain": 3, "domains": {f"robot_{k}": 7 for k in range(count // 2, count)}}


def frames(net):
    return net.graph.context.discovery_frames


def total(net):
    return sum(net.graph.context.discovery_bytes.values())


def assert_discovery_is_that_of_two_fleets():
    """All that two domains of three hosts send, and its bytes, is twice that of three hosts; all
    multicasts arrive at all six."""
    for preset in ("cyclonedds", "fastdds"):
        alone, both = robots(3, preset), robots(6, preset, **halves(6))
        alone.run(15 * S)
        both.run(15 * S)
        assert frames(both) == {kind: 2 * count for kind, count in frames(alone).items()}
        assert total(both) == 2 * total(alone)


def test_two_domains_cost_what_two_fleets_cost():
    assert_discovery_is_that_of_two_fleets()


def test_they_would_not_if_domains_did_not_count(monkeypatch):
    monkeypatch.setattr(Dds, "domains", lambda self, hosts: [0] * len(hosts))
    with pytest.raises(AssertionError):
        assert_discovery_is_that_of_two_fleets()


def test_foreign_announcements_reach_the_interface_and_no_more():
    """Two hosts that are alone in their domains: six announcements of Fast DDS in the first 0.5 s
    and one every 3 s, each of 494 B with all headers; nothing is ever answered."""
    net = robots(2, "fastdds", **halves(2)).run(20 * S)
    count = 6 + len(range(3500, 20_000, 3000))
    size_bytes = 356 + 20 + 12 + 60 + 46
    assert frames(net) == {"spdp": 2 * count}
    for host in net.graph.hosts:
        assert host.tx_bytes == host.rx_bytes == count * size_bytes
    assert all(not me.remotes for me in net.graph.middleware.participants.values())


def test_a_reader_of_another_domain_is_none():
    heard = []
    net = Net({"robot_0": talker([(2 * S, "a"), (3 * S, "b")], "/t"),
               "robot_1": listener(heard, "/t", 5), "robot_2": listener(heard, "/t", 5)},
              middleware=dds(domains={"robot_2": 1})).run(5 * S)
    assert [(host, text) for _, host, _, text in heard] == [("robot_1", "a"), ("robot_1", "b")]
    counts, beliefs = net.counts("/t"), net.graph.context.beliefs
    assert (counts.intended, counts.delivered, counts.unmatched) == (2, 2, 0)
    assert conserved(net, "/t")
    assert (beliefs.matches, beliefs.missing, beliefs.ghosts) == (1, 0, 0)


def test_the_first_pattern_that_fits_counts():
    model = dds(domain=1, domains={"robot_1": 2, "robot_*": 3})
    assert model.domains(["base", "robot_0", "robot_1"]) == [1, 3, 2]


def test_a_pattern_without_hosts_is_refused():
    with pytest.raises(InputError, match=r"^middleware\.domains\.robt_1: 'robt_1' names no host "
                                         r"\(did you mean 'robot_1'\?\)"):
        robots(2, domains={"robt_1": 3})


def test_a_server_has_one_domain():
    with pytest.raises(InputError, match=r"^middleware\.domains: all hosts are clients of one"):
        robots(4, "fastdds", discovery="server", server="robot_0", **halves(4))


def test_ports_are_those_of_rtps():
    """PB 7400, DG 250, PG 2, d3 11; the figures of ROS 2's documentation of ROS_DOMAIN_ID: of a
    computer 120 processes in a domain, 54 in 101 (below Linux's ephemeral ports, from 32768 on), 63
    in the last one, 232."""
    assert MOST_DOMAIN == 232
    assert [multicast_port(domain) for domain in (0, 1, 101)] == [7400, 7650, 32650]
    assert last_port(0, 120) < multicast_port(1) <= last_port(0, 121)
    assert last_port(101, 54) < 32768 <= last_port(101, 55)
    assert last_port(232, 63) <= 65535 < last_port(232, 64)


@pytest.mark.parametrize(("count", "domains", "said"), [
    (64, {"*": 232}, "64 of a host in domain 232 take ports up to 65537, and the last one is "
                     "65535; allowed there: at most 63"),
    (121, {"robot_1": 1}, "121 of a host in domain 0 take ports up to 7651, a port of another "
                          "domain; allowed there: at most 120")])
def test_more_participants_than_ports_are_refused(count, domains, said):
    model = Dds(configured(Dds.Params, preset="fastdds", participants=count, domains=domains))
    with pytest.raises(InputError) as error:
        Net({"robot_0": silent, "robot_1": silent}, middleware=model)
    assert str(error.value) == f"middleware.participants: {said}"
