"""Zenoh's peers: links between all, gossip, messages that go nowhere but to their readers."""

import pytest
from graphs import MS, S, listener, silent, talker
from zenoh_networks import conserved, control, mesh, net_of, sees

from desim.errors import InputError
from desim.middleware.zenoh import gossip
from desim.ports import PASS, Drop


class Wall:
    """Nothing gets from "a" to "b" or back from 10 s on."""

    reasons = ("wall",)

    def start(self, context, hosts):
        self._context = context

    def judge(self, frame, receivers):
        late = self._context.now_ns >= 10 * S
        return [Drop("wall") if late and {frame.source, one} == {0, 1} else PASS
                for one in receivers]


PEER = {"mode": "peer", "open_wait": "500 ms"}
STATE, STUB, HEAD, INTEREST, TCP = 43, 22, 15, 5, 70  # measured, bytes


def one_after_another(count, apart_ns=300 * MS, nodes=silent, **params):
    """Peers that start so far apart, after 12 s and more."""
    hosts = [f"h{k}" for k in range(count)]
    net = net_of(dict.fromkeys(hosts, nodes), **{**PEER, **params})
    for k, host in enumerate(hosts[1:], 1):
        net.graph.host(host).stop()
        net.at(k * apart_ns, net.graph.host(host).start)
    return net.run(12 * S)


def news_of(net):
    """Messages that say where one peer is."""
    return [row for row in control(net, "gossip") if row[5] == TCP + HEAD + STATE]


def gossip_bytes(net):
    return sum(row[5] - TCP for row in control(net, "gossip"))


def assert_gossip_costs_what_it_should():
    """With n peers: over each new link both ends tell of all peers that they know, and each peer
    tells all its earlier neighbours of each new one: n (n - 1) (n - 2) / 2 messages where links
    open one by one. In a mesh that grows so the k-th peer (from 0) is told by each of k of all k
    peers, and tells the j-th of these of itself and j others."""
    for count in 2, 3:
        net = one_after_another(count)
        assert mesh(net) == [count - 1] * count
        news = news_of(net)
        assert len(news) == count * (count - 1) * (count - 2) // 2
        links = range(1, count)
        from_old = sum(k * (HEAD + INTEREST + k * STATE + STUB) for k in links)
        from_new = sum(HEAD + INTEREST + (1 + j) * STATE + STUB for k in links for j in range(k))
        assert gossip_bytes(net) == from_old + from_new + len(news) * (HEAD + STATE)


def test_gossip_costs_what_it_should():
    assert_gossip_costs_what_it_should()


@pytest.mark.parametrize(("count", "measured"), [(4, 12), (8, 199)])
def test_news_are_as_many_as_real_peers_have_sent(count, measured):
    """Of zenoh 1.10.2, 50 ms apart. Several links of a new peer open at once, so that some news are
    told twice: of 8 more than 8 * 7 * 6 / 2 = 168."""
    net = one_after_another(count, 50 * MS)
    assert mesh(net) == [count - 1] * count
    assert len(news_of(net)) == pytest.approx(measured, rel=0.1)


def test_with_shorter_addresses_it_would_not(monkeypatch):
    monkeypatch.setattr(gossip, "_KNOWN_BYTES", 40)
    with pytest.raises(AssertionError):
        assert_gossip_costs_what_it_should()


def test_messages_go_straight_to_their_readers():
    heard = []
    net = net_of({"a": talker([(2 * S, "one")]), "b": listener(heard), "c": listener(heard),
                  "d": silent}, **PEER).run(5 * S)
    assert sorted(row[2:4] for row in net.rows("frame")) == [("a", "b"), ("a", "c")]
    assert sorted(host for _, host, *_ in heard) == ["b", "c"]
    conserved(net)


@pytest.mark.parametrize("mode", ["peer", "router"])
def test_where_a_link_is_cut_peers_do_not_go_round(mode):
    """A router does: over c."""
    heard = []
    net = net_of({"a": talker([(30 * S, "one")]), "b": listener(heard), "c": silent},
                 rules=[Wall()], **{**PEER, "mode": mode})
    net.run(35 * S)
    assert mesh(net) == [1, 1, 2]
    assert [text for *_, text in heard] == ["one"] * (mode == "router")
    if mode == "peer":
        assert sorted(row[1:] for row in sees(net) if row[3] == "offline") == [
            ("a", "b", "offline"), ("b", "a", "offline")]
    conserved(net)


def test_peers_that_all_connect_to_one_find_each_other_by_its_gossip():
    heard = []
    nodes = {"a": talker([(2 * S, "one"), (60 * S, "two")]), "base": silent,
             "c": listener(heard)}
    net = net_of(nodes, discovery="connect", connect=["base"], **PEER).run(5 * S)
    assert mesh(net) == [2, 2, 2]
    assert control(net, "scout") == []
    net.graph.host("base").stop()
    net.run(65 * S)
    assert len(net.graph.middleware._routers[0].links) == 1
    assert [text for *_, text in heard] == ["one", "two"]
    conserved(net)


def test_a_peer_declares_when_it_has_found_others_or_after_half_a_second():
    net = one_after_another(3, 2 * S, talker([(11 * S, "x")]))
    first = {}
    for time_ns, _, host, *_ in control(net, "declare"):
        first.setdefault(host, time_ns)
    assert 2 * S < first["h0"] < first["h1"] < 2 * S + 20 * MS
    assert 4 * S < first["h2"] < 4 * S + 30 * MS


def test_peers_with_routers_are_refused():
    with pytest.raises(InputError, match=r"^middleware\.routers: peers have none; leave it out, or "
                                         r"take mode router$"):
        net_of({"a": silent, "b": silent}, mode="peer", routers=["a"])
