"""Zenoh: the way round what is broken, and what becomes of messages meanwhile."""

import pytest
from graphs import MS, S, Words, listener, silent, talker
from hypothesis import Phase, given, settings
from hypothesis import strategies as st
from tcp_hosts import Losing
from zenoh_networks import conserved, link, mesh, net_of, partition, sees

from desim.errors import InputError
from desim.ports import PASS, Drop

# ------------------------------------------------------------------------------------ the way round


def test_a_star_passes_messages_through_its_middle():
    heard = []
    net = net_of({"a": talker([(S, "one")]), "base": silent, "c": listener(heard)},
                 discovery="connect", connect=["base"]).run(5 * S)
    assert mesh(net) == [1, 2, 1]
    assert [row[2:4] for row in net.rows("frame")] == [("a", "base"), ("base", "c")]
    assert [text for *_, text in heard] == ["one"]
    assert {row[1:3] for row in sees(net)} == {(a, b) for a in ("a", "base", "c")
                                               for b in ("a", "base", "c") if a != b}
    conserved(net)


def test_gossip_makes_a_mesh_of_a_star():
    net = net_of(dict.fromkeys("abcd", silent), discovery="connect", connect=["a"], gossip=True)
    assert mesh(net.run(5 * S)) == [3, 3, 3, 3]


def test_hosts_without_a_router_keep_one_link():
    heard = []
    net = net_of({"a": talker([(10 * S, "one")]), "b": silent, "c": silent, "d": listener(heard)},
                 routers=["b", "c"], connect=["b", "c"]).run(20 * S)
    links = mesh(net)
    assert links[0] == links[3] == 1 and sum(links) == 6
    assert [text for *_, text in heard] == ["one"]
    conserved(net)


def test_the_way_round_a_broken_link():
    """Between a and c nothing gets through from 5 s on: after the lease what a says goes by b."""
    heard = []
    net = net_of({"a": talker([(k * S, str(k)) for k in range(1, 30)]), "b": silent,
                  "c": listener(heard)},
                 rules=[Apart("a", "c")])
    net.run(40 * S)
    assert ("a", "c", "offline") not in {row[1:] for row in sees(net)}
    assert [int(text) for *_, text in heard][-10:] == list(range(20, 30))
    assert ("b", "c") in {row[2:4] for row in net.rows("frame")}
    conserved(net)


class Apart:
    """A rule: from 5 s on nothing gets from one host to another one, or back."""

    reasons = ("apart",)

    def __init__(self, *pair):
        self._pair = pair

    def start(self, context, hosts):
        self._context = context
        self._hosts = {hosts.index(host) for host in self._pair}

    def judge(self, frame, receivers):
        if self._context.now_ns < 5 * S or frame.source not in self._hosts:
            return None
        return [Drop("apart") if receiver in self._hosts else PASS for receiver in receivers]


# -------------------------------------------------------------------------------------- in trouble


def test_a_host_that_restarts_is_found_anew():
    heard = []
    says = [(k * S, str(k)) for k in range(1, 30)]
    net = net_of({"a": talker(says), "b": listener(heard, queue=2), "c": talker(says)})
    net.at(5 * S + 5 * MS, net.graph.host("b").stop)
    net.at(6 * S + 5 * MS, net.graph.host("b").start)
    net.run(40 * S)
    assert mesh(net) == [2, 2, 2]
    assert net.graph.context.beliefs.divergence == 0
    conserved(net)
    for source in "ac":
        texts = [int(text) for _, _, who, text in heard if who == source]
        assert texts[:5] == [1, 2, 3, 4, 5] and texts[-20:] == list(range(10, 30))


def test_a_dead_host_leaves_ghosts_until_the_lease():
    net = net_of({"a": talker([]), "b": listener([])})
    net.at(20 * S, net.graph.host("b").stop)
    ghosts = []
    for time_s in (19, 21, 27, 31):
        net.run(time_s * S)
        ghosts.append(net.graph.context.beliefs.ghosts)
    assert ghosts == [0, 1, 1, 0]


@pytest.mark.parametrize(("transport", "queue", "lost"), [
    ("stream", 1, {"congested"}), ("datagram", 0, {"congested"}), ("stream", 0, set())])
def test_a_congested_link(transport, queue, lost):
    """Ten times as much as it carries: what does not keep all is dropped. Nothing stands still, so
    the link stays."""
    heard = []
    says = [(5 * S + k * 100 * MS, str(k)) for k in range(100)]
    net = net_of({"a": talker(says, size_bytes=100_000, transport=transport, queue=queue),
                  "b": listener(heard)}, link(rate="1 Mb/s", queue="100 kB"), lease="60 s",
                 wait_before_close="5 s")
    net.run(120 * S)
    counts = net.counts("/talk")
    assert set(counts.dropped) == lost
    assert counts.delivered + sum(counts.dropped.values()) == 100
    assert mesh(net) == [1, 1]
    conserved(net)


def test_a_fate_has_the_instants_of_the_first_and_the_last_frame():
    """In a star: of those on the first link the first one, of those on the second link, where a
    frame is lost, the last one; and of what never arrives the last attempt before the link is
    closed."""
    star = net_of({"a": talker([(5 * S, "1"), (7 * S, "2")], size_bytes=1000),
                   "b": silent, "c": listener([])}, rules=[
        Losing(1, source=1, least_bytes=1000), partition("6 s", "20 h", ["c"])],
        discovery="connect", connect=["b"]).run(60 * S)
    assert [(reason, *(time_ns // MS for time_ns in times))
            for _, _, _, reason, *times in star.fates] == [
        ("delivered", 5000, 5206), ("link_closed", 7000, 13_366)]


def test_what_never_left_has_no_instants():
    """The first message has 8 s to go when its host stops, the second is behind it."""
    net = net_of({"a": talker([(5 * S, "one"), (5 * S, "two")], size_bytes=10**6),
                  "b": listener([])}, link(rate="1 Mb/s"))
    net.at(6 * S, net.graph.host("a").stop)
    (_, *one), two = net.run(8 * S).fates
    assert one[2] == "sender_down" and one[3] == 5 * S < one[4] < 6 * S
    assert two == (2, "b", 6 * S, "sender_down", -1, -1)


def test_a_stream_that_blocks_a_link_closes_it():
    """From 5 s on nothing gets through. Batches fill, then the publisher waits; 5 s later the link
    is closed, long before the lease."""
    says = [(5 * S + k * 100 * MS, str(k)) for k in range(100)]
    def gone_s(queue):
        net = net_of({"a": talker(says, size_bytes=100_000, queue=queue), "b": listener([])},
                     rules=[partition("5 s", "1 h")], lease="60 s", wait_before_close="5 s")
        net.run(64 * S)
        conserved(net)
        return [time_s for time_s, _, _, state in sees(net, "a") if state == "offline"]

    full_s = 5 + 0.3  # the first is on its way, the second in the writer's hands, the third fills
    assert gone_s(queue=0) == [pytest.approx(full_s + 5)]
    assert gone_s(queue=1) == [pytest.approx(60.1, abs=0.1)], "nobody is blocked, the lease ends"


@pytest.mark.parametrize(("queue", "wait_ns"), [(0, 5 * S), (1, 2 * MS)])
def test_who_publishes_waits_as_long(queue, wait_ns):
    """As above: the fourth message finds no room. One that blocks waits until the link is closed,
    the others 1 ms for each of two batches; in between the node does nothing else."""
    ticks = []

    def begin(node):
        node.advertise("/talk", queue=queue)

        def tick(k):
            ticks.append((node.now_ns, "tick"))
            node.publish("/talk", Words(str(k), 100_000))

        node.after(5 * S, lambda _: node.timer(10, tick, "zero"))
        node.after(5 * S + 301 * MS, lambda _: ticks.append((node.now_ns, "other")))

    net_of({"a": begin, "b": listener([])}, rules=[partition("5 s", "1 h")], lease="60 s",
           wait_before_close="5 s").run(5 * S + 300 * MS + wait_ns + 10 * MS)
    assert [what for _, what in ticks[:5]] == ["tick"] * 4 + ["other"]
    assert ticks[4][0] == pytest.approx(5 * S + 300 * MS + wait_ns, abs=10)


@settings(max_examples=12, deadline=None, phases=[Phase.explicit, Phase.reuse, Phase.generate])
@given(st.lists(st.tuples(st.integers(0, 30_000), st.sampled_from(["stop", "start", "cut"]),
                          st.sampled_from("abcd"), st.integers(10, 20_000)), max_size=8),
       st.sampled_from([{}, {"gossip": True, "discovery": "connect", "connect": ["a"]},
                        {"routers": ["b", "c"]},
                        {"preset": "rmw_zenoh", "lease": "4 s", "batch": "2 kB"}]))
def test_it_recovers_from_everything(outages, params):
    """Hosts stop and start, and are cut off, in any order. At any instant each message has one
    fate or waits; in the end everybody is linked again, knows what is true and hears the rest."""
    heard = []
    says = [(k * S, str(k)) for k in range(1, 100)]
    rules = [partition(f"{at} ms", f"{at + lasts} ms", [host])
             for at, what, host, lasts in outages if what == "cut"]

    def begin(host):
        def both(node):
            listener(heard, queue=9)(node)
            talker(says, transport="stream" if host in "ab" else "datagram", queue=3)(node)
            talker(says, "/big", 30_000)(node)
        return both

    net = net_of({host: begin(host) for host in "abcd"}, link(rate="2 Mb/s"), rules, **params)
    for at, what, host, _ in outages:
        if what != "cut":
            net.at(at * MS, getattr(net.graph.host(host), what))
    for host in "abcd":
        net.at(30_001 * MS, net.graph.host(host).start)
    for k in range(96):
        net.run(k * S)
        if all(net.graph.up):
            conserved(net)
    assert net.graph.context.beliefs.divergence == 0
    for host in "abcd":
        for source in "abcd":
            late = [int(text) for time_ns, who, whom, text in heard
                    if (who, whom) == (host, source) and time_ns >= 80 * S]
            assert late == sorted(set(late)) and {*range(81, 94)} <= set(late), (host, source)


def test_what_it_does_not_know_it_refuses():
    with pytest.raises(InputError, match="allowed: unicast"):
        net_of({"a": talker([], via="broadcast"), "b": silent})
    with pytest.raises(InputError, match=r"connect\.0: no host 'bse'"):
        net_of({"a": silent, "base": silent}, connect=["bse"])
    with pytest.raises(InputError, match="name hosts"):
        net_of({"a": silent}, discovery="connect")
    with pytest.raises(InputError, match="a has no router"):
        net_of({"a": silent, "b": silent}, connect=["a"], routers=["b"])


def test_a_scout_asks_for_no_address():
    """It goes to all: what b has missed while it was down does not wait for it."""
    net = net_of({"a": silent, "b": silent}, tcp={"arp": "natural"})
    net.graph.host("b").stop()
    net.at(10 * S, net.graph.host("b").start)
    net.run(10 * S)
    assert not [row for row in net.rows("control") if row[4] == "arp"]
    hellos = net.graph.context.discovery_frames.get("hello", 0)
    net.run(11 * S)
    assert net.graph.context.discovery_frames["hello"] - hellos == 1  # to b's own scout
