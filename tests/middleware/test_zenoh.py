"""Zenoh: whole logs of small cases, and what its constants say of larger ones.

A comparison gives what the model does beside what was expected. Where a constant is a little off,
the two must not agree: that is what the twins with ``wrong`` show.
"""

import pytest
from graphs import MS, S, listener, silent, talker
from zenoh_networks import conserved, control, link, mesh, net_of, partition, sees

from desim.middleware.zenoh import link_state_flood
from desim.middleware.zenoh.link import RouterLink
from desim.middleware.zenoh.sizes import node_bytes, push_bytes, subscriber_bytes, token_bytes

# ------------------------------------------------------------------------------------- whole logs


def test_two_hosts_meet_and_talk():
    """B is there when a comes, scouts, is greeted and calls; four messages open the link; link
    states; 100 ms later declarations; then the latched word."""
    heard = []
    net = net_of({"a": talker([(10 * MS, "one"), (900 * MS, "two")], latch=True),
                  "b": listener(heard)})
    net.graph.host("a").stop()
    net.at(10 * MS, net.graph.host("a").start)
    net.run(1100 * MS)
    state = 70 + 15 + 44 + 22  # a router, its address and its neighbour, of which no more is known
    assert net.rows("control", "sees", "believes", "frame", "delivered") == [
        (0, "control", "b", "medium/lan", "scout", 49),
        (10_000_000, "control", "a", "medium/lan", "scout", 49),
        (11_000_392, "control", "b", "a", "hello", 86),
        (12_001_080, "control", "a", "b", "link", 78),
        (13_001_704, "control", "b", "a", "link", 78),
        (14_002_328, "control", "a", "b", "link", 70),
        (14_002_328, "control", "a", "b", "link", 70 + 34),
        (15_003_720, "control", "b", "a", "link", 70 + 93),
        (16_005_024, "control", "a", "b", "link", 70 + 78),
        (17_006_208, "control", "b", "a", "link", 70 + 19),
        (17_006_208, "control", "b", "a", "linkstate", state),
        (17_006_208, "sees", "b", "a", "online", 0),
        (18_006_920, "control", "a", "b", "linkstate", state),
        (18_006_920, "sees", "a", "b", "online", 0),
        (18_008_128, "control", "a", "b", "linkstate", 70 + 15 + 27),
        (19_008_128, "control", "b", "a", "linkstate", 70 + 15 + 27),
        (117_006_208, "control", "b", "a", "declare", 70 + 7 + node_bytes("node")
         + subscriber_bytes("/talk") + token_bytes("node", "/talk")),
        (118_006_920, "control", "a", "b", "declare",
         70 + 7 + node_bytes("node") + token_bytes("node", "/talk")),
        (118_010_064, "believes", "a", "b", "/talk", 1),
        (118_010_064, "frame", "a", "b", 1, 70 + 172),
        (119_012_560, "delivered", "b", "a", 1, 1_002_496),
        (900_000_000, "frame", "a", "b", 2, 70 + 172),
        (901_001_936, "delivered", "b", "a", 2, 1_001_936),
        (S, "control", "b", "medium/lan", "scout", 49),
        (1_001_000_392, "control", "a", "b", "hello", 86),
        (1_010_000_000, "control", "a", "medium/lan", "scout", 49),
        (1_011_000_392, "control", "b", "a", "hello", 86)]
    assert [text for *_, text in heard] == ["one", "two"]


def test_sizes_are_the_measured_ones():
    """Captured between routers of zenoh 1.10.2: the declaration of a subscriber of 121 B of key and
    of a token of 196 B, each with the head of its batch; messages of 100 B and 60 kB."""
    assert 7 + subscriber_bytes("/robot_1/map") == 143
    assert 7 + token_bytes("explore", "/robot_1/map") == 219
    assert push_bytes(100, 49_152) == 172
    assert push_bytes(60_000, 49_152) == 49_152 + 10_930


def test_endpoints_are_called_again_after_1_2_4_and_4_s():
    """A's port is closed: it is down."""
    net = net_of({"a": silent, "b": silent}, discovery="connect", connect=["a"],
                 tcp={"syn_retries": 0, "syn_linear": 0})
    net.graph.host("a").stop()
    net.run(20 * S)
    assert [row[0] / S for row in control(net, "link")] == [0, 2, 5, 10, 15, 20]


def test_a_link_that_is_lost_comes_back_and_so_does_what_went_over_it():
    """Cut for 20 s, for longer than a lease: both ends give up 10 s after they last heard of the
    other; the next scout finds the way again, and all is declared once more."""
    heard = []
    net = net_of({"a": talker([(k * S, str(k)) for k in range(1, 60)]), "b": listener(heard)},
                 rules=[partition("20.5 s", "40.5 s")])
    net.run(70 * S)
    (up_a, *_), (up_b, *_), (down_b, *_), (down_a, *_), *again = sees(net)
    assert sees(net)[2:4] == [(down_b, "b", "a", "offline"), (down_a, "a", "b", "offline")]
    assert 30 < down_b < down_a < 31
    assert up_a <= up_b < 0.01
    assert [(who, state) for _, who, _, state in again] == [("a", "online"), ("b", "online")]
    assert 40.5 < again[0][0] < 48.5, "at the first scout of one of them"
    declared = control(net, "declare")
    assert [row[2:] for row in declared[:2]] == [row[2:] for row in declared[2:]]
    conserved(net)
    counts = net.counts("/talk")
    assert counts.dropped == {"link_closed": 10}
    assert [int(text) for *_, text in heard] == [*range(1, 21), *range(48, 60)]


# ---------------------------------------------------------------------------------- what is known


def scouts(**wrong):
    """Times of a router's scouts, beside 1, 2, 4, 8, 8 s between them."""
    net = net_of({"a": silent, "b": silent}, **wrong)
    net.graph.host("b").stop()
    net.run(40 * S)
    return [row[0] / S for row in control(net, "scout") if row[2] == "a"], [0, 1, 3, 7, 15, 23, 31,
                                                                            39]


def resting(**wrong):
    """Bytes per second of a link that rests, beside two keepalives every quarter of a lease, 3 B in
    70 B of headers, that cross, and their acknowledgements."""
    net = net_of({"a": silent, "b": silent}, discovery="connect", connect=["a"], **wrong)
    context, totals = net.graph.context, []
    for until_s in (25, 1025):
        net.run(until_s * S)
        totals.append(sum(context.discovery_bytes.values()))
    return (totals[1] - totals[0]) / 1000, (2 * 73 + 2 * 70) / 2.5


def silence(preset, lease_s, keep_alive, **wrong):
    """From the last word of a host that dies in silence to when it is missed, beside the lease."""
    net = net_of({"a": silent, "b": silent}, preset=preset, **wrong)
    net.at(200 * S + 1, net.graph.host("b").stop)
    net.run(300 * S)
    ((gone_s, *_),) = [row for row in sees(net, "a") if row[3] == "offline"]
    last_s = max(row[0] for row in control(net, "keepalive") if row[2] == "b") / S
    assert 200 + lease_s - lease_s / keep_alive <= gone_s <= 200 + lease_s * 1.1
    return round(gone_s - last_s, 2), lease_s


def waking(outage_s, **wrong):
    """The arrival of a word that was said at the beginning of an outage, beside the sum of a probe
    after 0.2 s and of timeouts that double from 0.2 s: the first that ends after the outage. The
    round trip, in which acknowledgements have waited for answers, adds a little to each."""
    heard = []
    net = net_of({"a": talker([(5 * S, "one")]), "b": listener(heard)}, link(latency="10 us"),
                 rules=[partition("5 s", f"{5 + outage_s} s")], preset="rmw_zenoh", tcp=wrong)
    net.run(100 * S)
    expected_s = next(0.2 * 2**k for k in range(20) if 0.2 * 2**k >= outage_s)
    return [round(time_ns / S - 5, 3) for time_ns, *_ in heard], [round(expected_s, 3)]


def queueing(size_bytes, **wrong):
    """The arrival of a pose that was sent behind a map, over 1 Mb/s, beside the time that the map's
    bytes need: one connection carries both."""
    heard = []

    def speak(node):
        talker([(5 * S, "map")], "/map", size_bytes)(node)
        talker([(5 * S, "pose")], "/pose", 100)(node)

    def listen(node):
        listener(heard, "/map")(node)
        listener(heard, "/pose")(node)

    net = net_of({"a": speak, "b": listen}, link(rate="1 Mb/s"), preset="rmw_zenoh", **wrong)
    net.run(60 * S)
    assert [text for *_, text in heard] == ["map", "pose"]
    conserved(net)
    segments = -(-size_bytes // 1448)
    return (heard[1][0] - 5 * S) / S, (size_bytes + 70 * segments) * 8 / 1e6


def test_scouts_go_after_1_2_4_8_and_8_s():
    done, expected = scouts()
    assert done == expected
    assert scouts(scout_first="1.1 s")[0] != expected
    assert scouts(scout_last="8.4 s")[0] != expected


def test_keepalives_are_a_few_bytes_a_second():
    done, expected = resting()
    assert done == pytest.approx(expected, rel=0.01)
    assert resting(lease="10.6 s")[0] != pytest.approx(expected, rel=0.01)


@pytest.mark.parametrize(("preset", "lease_s", "keep_alive"), [
    ("zenoh", 10, 4), ("rmw_zenoh", 60, 2), ("rmw_zenoh_2024", 10, 4)])
def test_a_silent_death_is_noticed_after_the_lease(preset, lease_s, keep_alive):
    done, expected = silence(preset, lease_s, keep_alive)
    assert done == expected
    assert silence(preset, lease_s, keep_alive, lease=f"{lease_s * 1.05} s")[0] != expected


@pytest.mark.parametrize("outage_s", [0.3, 1.5, 3.5, 7])
def test_a_link_that_was_down_wakes_up_late(outage_s):
    done, expected = waking(outage_s)
    assert done == pytest.approx(expected, rel=0.03)
    assert outage_s <= expected[0] <= 2 * outage_s
    assert waking(outage_s, rto_min="212 ms")[0] != pytest.approx(expected, rel=0.03)


def test_a_pose_waits_behind_a_map():
    done, expected = queueing(600_000)
    assert done == pytest.approx(expected, rel=0.02)
    assert queueing(640_000)[0] != pytest.approx(expected, rel=0.02)


@pytest.mark.parametrize(("routers", "measured_bytes"), [(2, 280), (4, 4481), (8, 71_789)])
def test_link_states_of_a_fleet_that_starts_cost_what_was_measured(monkeypatch, routers,
                                                                  measured_bytes):
    """Between routers of zenoh 1.10.2 in a full mesh that started one after another, 0.3 s apart;
    the twin has shorter addresses."""
    def said():
        total, send = 0, RouterLink.send

        def count(self, kind, size_bytes, *what):
            nonlocal total
            total += size_bytes * (kind == "linkstate")
            send(self, kind, size_bytes, *what)

        monkeypatch.setattr(RouterLink, "send", count)
        hosts = [f"h{k}" for k in range(routers)]
        net = net_of(dict.fromkeys(hosts, silent), link(rate="10 Gb/s", latency="50 us"))
        for k, host in enumerate(hosts[1:]):
            net.graph.host(host).stop()
            net.at((k + 1) * 300 * MS, net.graph.host(host).start)
        net.run(12 * S)
        assert mesh(net) == [routers - 1] * routers
        return total

    assert said() == pytest.approx(measured_bytes, rel=0.15)
    monkeypatch.setattr(link_state_flood, "LOCATOR_BYTES", 10)
    assert said() != pytest.approx(measured_bytes, rel=0.15)


def test_declarations_grow_with_the_links():
    """Ten subscribers on one host: it tells each of the others once (as measured)."""
    for hosts in 2, 4, 8:
        def listen(node):
            for k in range(10):
                listener([], f"/topic_{k}")(node)

        nodes = {f"h{k}": silent for k in range(hosts)}
        net = net_of({**nodes, "h0": {"ears": listen}}).run(5 * S)
        declared = [row for row in control(net, "declare") if row[2] == "h0"]
        assert len(declared) == hosts - 1 and len({row[5] for row in declared}) == 1
        assert not net.graph.context.beliefs.missing


def test_news_that_wait_for_a_busy_router_cost_what_they_would_one_by_one():
    """In fewer frames, each a train of as many packets as there are changes."""
    def flooded(flood):
        hosts = [f"h{k}" for k in range(10)]
        net = net_of(dict.fromkeys(hosts, silent), link(rate="10 Gb/s", latency="50 us"),
                     scout_jitter="20 ms", flood=flood)
        net.run(5 * S)
        assert mesh(net) == [9] * 10
        context = net.graph.context
        return context.discovery_bytes["linkstate"], context.discovery_frames["linkstate"]

    one_by_one, together = flooded("0 s"), flooded("200 us")
    assert together[0] == pytest.approx(one_by_one[0], rel=0.05)
    assert together[1] < one_by_one[1] / 2
