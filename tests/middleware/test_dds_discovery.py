"""DDS discovery: what it costs beside measured packets, and whole logs of how it goes.

Measured with Cyclone DDS 11.0.1 on loopback, multicast for SPDP alone, each process with 17
endpoints named like those of a ROS 2 node; Ethernet frames of the first 15 s.
"""

import re

import pytest
from configured import configured
from graphs import MS, Net, S, listener, silent, talker
from pydantic import ValidationError

from desim.errors import InputError
from desim.middleware.dds import wire
from desim.middleware.dds.dds import Dds
from netmodels.rules.loss import Loss

CYCLONE, FAST = wire.CYCLONEDDS, wire.FASTDDS
MEASURED_BYTES = {2: 19_200, 4: 130_000, 8: 576_000}  # a second time: 22.6, 125.9, 595.9 kB


def dds(preset="cyclonedds", **params):
    return Dds(configured(Dds.Params, preset=preset, **{"start_spread": "0 ns", **params}))


def robots(count, seed=0, **options):
    return Net({f"robot_{k}": silent for k in range(count)}, middleware=dds(**options), seed=seed)


def total(net):
    return sum(net.graph.context.discovery_bytes.values())


def starting_together(count, seed=0):
    """Bytes in 15 s of ``count`` participants that a loop has started: within 200 ms."""
    return total(robots(count, seed, start_spread="200 ms").run(15 * S))


def assert_bytes_are_those_that_were_measured():
    for count, measured in MEASURED_BYTES.items():
        for seed in 0, 1:
            assert starting_together(count, seed) == pytest.approx(measured, rel=0.15)


def test_discovery_bytes_are_those_that_were_measured():
    assert_bytes_are_those_that_were_measured()


def test_of_endpoints_that_take_a_tenth_less_they_are_not(monkeypatch):
    whole = wire.RtpsVendor.built_in_endpoints
    monkeypatch.setattr(wire.RtpsVendor, "built_in_endpoints", lambda self, *which: [
        each._replace(size_bytes=each.size_bytes * 9 // 10) for each in whole(self, *which)])
    with pytest.raises(AssertionError):
        assert_bytes_are_those_that_were_measured()


def by_pair(pairs):
    """Bytes but for the multicasts, for each of ``pairs(n)``."""
    multicast = CYCLONE.announcement(2).size_bytes + CYCLONE.announcement().size_bytes
    return [(starting_together(count) - count * multicast) / pairs(count) for count in (2, 4, 8)]


def test_discovery_grows_with_the_ordered_pairs():
    each = by_pair(lambda n: n * (n - 1))
    assert max(each) / min(each) < 1.05


def test_and_not_with_the_square():
    each = by_pair(lambda n: n * n)
    assert not max(each) / min(each) < 1.05


@pytest.mark.parametrize(("count", "measured_bps"), [(2, 155), (8, 105)])
def test_at_rest_a_pair_takes_as_much_as_measured_after_8_s(count, measured_bps):
    """105 to 155 B/s: one round of announcements and liveliness, in the 7 s up to 15 s."""
    net = robots(count).run(8 * S - 1)
    before = total(net)
    rate = (total(net.run(15 * S)) - before) / 7 / (count * (count - 1))
    assert rate == pytest.approx(measured_bps, rel=0.05)


def at_rest(**options):
    """Bytes per second and ordered pair of four participants, over ten periods."""
    net = robots(4, **options).run(17 * S)
    before = total(net)
    return (total(net.run(97 * S)) - before) / 80 / 12


def test_in_the_long_run_it_is_one_round_in_eight_seconds():
    """Liveliness and its acknowledgement, an announcement to each, one to all: 166 B less the four
    of check sequences, 106, 394 and 394 / 3 were measured."""
    round_bytes = 158 + 4 + 106 + 4 + (394 + 4) * (1 + 1 / 3)
    assert at_rest() == pytest.approx(round_bytes / 8, rel=0.001)
    assert at_rest(liveliness_period="7.2 s") != pytest.approx(round_bytes / 8, rel=0.001)


def test_single_messages_are_as_long_as_those_on_the_wire():
    """Without the check sequence of 4 B, which a capture does not see."""
    assert CYCLONE.announcement().size_bytes - 4 == 394
    assert CYCLONE.announcement(2).size_bytes - 4 == 710
    assert CYCLONE.heartbeats(5).size_bytes - 4 == 238
    assert CYCLONE.acknacks(5).size_bytes - 4 == 218
    assert CYCLONE.acknacks(1).size_bytes - 4 == 106
    assert CYCLONE.heartbeat_to_all().size_bytes - 4 == 94
    assert CYCLONE.liveliness().size_bytes - 4 == 158
    announced = CYCLONE.built_in_endpoints((1, 1), "robot_1")
    assert [each.size_bytes for each in announced][:5] == [276, 316, 260, 272, 300]
    services = ["get_parameters", "set_parameters", "list_parameters", "describe_parameters",
                "get_parameter_types", "set_parameters_atomically"]
    kind = "rcl_interfaces::srv::dds_::GetParameters_"
    assert [CYCLONE.reader_bytes(f"rq/robot_1/{name}Request", f"{kind}Request_", wire.QUEUED)
            for name in services] == [324, 324, 324, 328, 328, 332]
    assert [CYCLONE.writer_bytes(f"rr/robot_1/{name}Reply", f"{kind}Response_", wire.QUEUED)
            for name in services] == [292, 292, 292, 296, 296, 304]
    apart = CYCLONE.new_endpoints(announced[:2], False)
    assert [message.size.size_bytes - 4 for message in apart] == [350, 390]
    again = CYCLONE.known_endpoints([
        wire.DiscoveredData((1, 1), wire.DataKind.WRITER, "", size)
        for size in (276, 260, 272, 292, 292)], 1456, False)
    assert [(message.size.size_bytes - 4, message.items) for message in again] == [
        (1226, 4), (382, 1)]
    (sample,) = CYCLONE.trains(804, 1344, 10, (True,))
    assert sample.size.size_bytes - 4 == 938


def test_those_of_fast_dds_too():
    """Captured with 2.9.1: a trailer of 60 B, one submessage in each but for endpoints."""
    assert FAST.announcement().size_bytes - 4 == 490
    assert (FAST.heartbeats(1).size_bytes - 4, FAST.heartbeats(3)) == (170, (3 * 174, 3))
    assert FAST.acknacks(1).size_bytes - 4 == 166
    assert FAST.acknacks(1, 9).size_bytes - 4 == 170
    announced = FAST.built_in_endpoints((1, 1), "robot_1")
    in_order = sorted(announced, key=lambda item: item.kind in wire.READERS)
    assert sorted(each.size_bytes for each in announced) == sorted([
        412, 384, 404, 424, 424, 424, 432, 432, 448, 412, 404, 428, 428, 428, 436, 436, 444])
    assert [(size.size_bytes - 4 * size.packets, size.packets, items)
            for size, items in FAST.known_endpoints(in_order, 65_500, False)] == [
        (4098, 3, 9), (3718, 3, 8)]
    assert [message.size.size_bytes - 4 for message in FAST.new_endpoints(announced[:3], True)] == [
        562, 562, 534]
    (sample,) = FAST.trains(1000, 65_324, 1, (True,))
    assert sample.size.size_bytes - 4 == 1210
    first, last = FAST.trains(100_000, 65_324, 1, (True, True))
    assert [(train.size.size_bytes - 4 * train.size.packets, train.size.packets)
            for train in (first, last)] == [(67_038, 45), (35_680, 24)]


def datagrams(dialect, size_bytes, fragment_bytes, most):
    """UDP messages of a sample: bytes with all headers, and packets of each."""
    count = len(dialect.messages(size_bytes, fragment_bytes, most))
    beats = (False,) * (count - 1) + (True,)
    return [train.size for train in dialect.trains(size_bytes, fragment_bytes, most, beats, 1)]


def test_a_large_sample_is_a_few_datagrams_that_ip_cuts():
    """20 008 B and their encapsulation went in 13 536 and 6656 B of RTPS; a map of 160 109 B in
    twelve datagrams of cyclonedds and three of fastdds."""
    first, last = datagrams(CYCLONE, 20_004, 1344, 10)
    assert (first.size_bytes, first.packets) == (13_536 + 46 + 9 * 38, 10)
    assert (last.size_bytes, last.packets) == (6656 + 46 + 4 * 38, 5)
    assert len(datagrams(CYCLONE, 160_109, 1344, 10)) == 12
    assert [size.packets for size in datagrams(FAST, 160_109, 65_324, 1)] == [45, 45, 21]


def test_datagrams_travel_in_trains():
    """Of up to 64 kB: four of cyclonedds, one of fastdds, which is 67 kB with its headers."""
    for dialect, fragment_bytes, most, parts in (CYCLONE, 1344, 10, [4, 4, 4]), (
            FAST, 65_324, 1, [1, 1, 1]):
        count = len(dialect.messages(160_109, fragment_bytes, most))
        trains = dialect.trains(160_109, fragment_bytes, most, (False,) * (count - 1) + (True,))
        assert [len(train.messages) for train in trains] == parts
        assert sum(train.size.size_bytes for train in trains) == sum(
            size.size_bytes for size in datagrams(dialect, 160_109, fragment_bytes, most))
        assert all(train.size.packets == sum(message.packets for message in train.messages)
                   for train in trains)


def test_the_whole_log_of_two_participants():
    """Announced twice in one packet, answered at once; heartbeats of the built-in writers after
    5 ms, acknowledged at once; endpoints after 35 ms, each in a packet of its own, and 5 ms later
    the first heartbeat of the topic; the next one of discovery is due 100 ms after the first."""
    net = Net({"a": talker([]), "b": listener([])}, middleware=dds()).run(900 * MS)
    log = [(t / MS, host, to, kind, size) for t, _, host, to, kind, size in net.rows("control")]
    assert log[:4] == [(0, "a", "medium/lan", "spdp", 714), (0, "b", "medium/lan", "spdp", 714),
                       (0, "a", "b", "spdp", 398), (0, "b", "a", "spdp", 398)]
    assert [(t, kind, size) for t, _, _, kind, size in log[4:12]] == [
        (5, kind, size)
        for kind, size in (("sedp_heartbeat", 242), ("sedp_acknack", 222), ("liveliness", 162),
                           ("acknack", 110)) for _ in range(2)]
    kinds = [(t, kind) for t, _, _, kind, _ in log[12:]]
    assert kinds == [(35, "sedp")] * 4 + [(35, "endpoints")] * 4 + [(35, "acknack")] * 4 + [
        (40, "heartbeat"), (40, "acknack")] + [
        (105, "sedp_heartbeat")] * 2 + [(105, "sedp_acknack")] * 2
    assert net.rows("believes", "sees") == [
        (0, "sees", "a", "b", "online", 0), (0, "sees", "b", "a", "online", 0),
        (35 * MS, "believes", "b", "a", "/talk", 1)]
    assert net.graph.context.beliefs.divergence == 0


def test_participants_do_not_start_in_one_nanosecond():
    net = robots(4, start_spread="200 ms").run(S)
    starts = sorted(row[0] for row in net.rows("control") if row[3] == "medium/lan")
    assert len(set(starts)) == 4 and starts[0] > 0 and starts[-1] < 200 * MS


@pytest.mark.parametrize("preset", ["fastdds", "cyclonedds"])
def test_discovery_survives_loss(preset):
    """One packet in five is lost: after a minute all know all."""
    nodes = {host: {"t": talker([], f"/{host}"), "l": lambda node: [
        listener([], f"/{other}")(node) for other in "abcd"]} for host in "abcd"}
    net = Net(nodes, middleware=dds(preset), rules=[Loss(Loss.Params(probability="20 %"))])
    net.run(60 * S)
    assert net.graph.context.beliefs.matches == 12
    assert net.graph.context.beliefs.divergence == 0


# ------------------------------------------------------------------------------ a server


def listening(count, preset="fastdds", **options):
    """Robots that talk and all listen to each other, by a server on ``robot_0``."""
    names = [f"robot_{k}" for k in range(count)]
    nodes = {name: {"t": talker([], f"/{name}/talk"), "l": lambda node: [
        listener([], f"/{other}/talk")(node) for other in names]} for name in names}
    return Net(nodes, middleware=dds(preset, **options))


def test_with_a_server_clients_talk_to_it_alone():
    net = listening(5, discovery="server", server="robot_0").run(15 * S)
    beliefs = net.graph.context.beliefs
    assert (beliefs.matches, beliefs.divergence) == (20, 0)
    assert all("robot_0" in row[2:4] for row in net.rows("control")
               if row[4] not in ("heartbeat", "acknack"))
    assert total(net) < 0.6 * total(listening(5).run(15 * S))


def test_a_server_tells_that_somebody_is_gone():
    """robot_3 is silent from 30.3 s on; the server heard it last at 30 s."""
    net = listening(4, discovery="server", server="robot_0")
    net.at(30_300 * MS, net.graph.host("robot_3").stop)
    net.run(60 * S)
    removed = [(row[0], row[2]) for row in net.rows("sees") if row[3:5] == ("robot_3", "removed")]
    assert [host for _, host in removed] == ["robot_0", "robot_1", "robot_2"]
    assert {time for time, _ in removed} == {removed[0][0]}
    assert 47 * S < removed[0][0] <= 50_300 * MS
    assert net.graph.context.beliefs.divergence == 0


def test_clients_outlive_their_server_and_find_its_next_life():
    net = listening(4, discovery="server", server="robot_0")
    net.at(5 * S, net.graph.host("robot_0").stop)
    net.at(60 * S, net.graph.host("robot_0").start)
    net.run(50 * S)
    assert net.graph.context.beliefs.divergence == 0, "those who know each other still do"
    net.run(90 * S)
    assert (net.graph.context.beliefs.matches, net.graph.context.beliefs.divergence) == (12, 0)


@pytest.mark.parametrize("preset", ["fastdds", "cyclonedds"])
def test_nobody_believes_in_a_former_life_of_itself(preset):
    """The server tells robot_1, which is back after a second, of its former life. Then it stops
    and forgets that one, so that nobody says that it is gone."""
    net = listening(3, preset=preset, discovery="server", server="robot_0")
    for start_s, until_s, host in (3, 4, "robot_1"), (6, 20, "robot_0"):
        net.at(start_s * S, net.graph.host(host).stop)
        net.at(until_s * S, net.graph.host(host).start)
    net.run(200 * S)
    beliefs = net.graph.context.beliefs
    assert (beliefs.matches, beliefs.divergence) == (6, 0)
    assert all(row[2] != row[3] for row in net.rows("sees", "believes"))


@pytest.mark.parametrize(("params", "complaint"), [
    ({"discovery": "server"}, ".server: the host"), ({"server": "b"}, ".server: the host"),
    ({"discovery": "server", "server": "c"}, ".server: no host 'c'; allowed: b, robot_a"),
    ({"discovery": "server", "server": "robota"}, "'robota' (did you mean 'robot_a'?); allowed: "),
    ({"leases": {"robot-a": "9 s"}}, ".leases: no host 'robot-a' (did you mean 'robot_a'?); ")])
def test_bad_hosts(params, complaint):
    with pytest.raises(InputError, match=re.escape(complaint)):
        Net({"robot_a": silent, "b": silent}, middleware=dds(**params))


@pytest.mark.parametrize(("params", "complaint"), [
    *(({field: "999 us"}, "'999 us' is too small; at least 1 ms") for field in (
        "lease", "initial_period", "announcement_period", "response_period", "heartbeat_period",
        "heartbeat_limit", "initial_acknack", "nack_renewal", "server_period")),
    ({"leases": {"a": "0 s"}}, "must be above zero"),
    ({"liveliness_period": "1 ns"}, "liveliness_period: 1 ns is too small; allowed: 0 ns, or at "),
    ({"preset": "fastdds", "lease": "3 s"}, "announcement_period: 3 s is not below the shortest "
     "lease, 3 s: who says nothing else would be removed between any two announcements; allowed: "
     "less than each lease, or null"),
    ({"preset": "fastdds", "leases": {"a": "2 s"}}, "3 s is not below the shortest lease, 2 s"),
    ({"announcement_period": "10 s"}, "10 s is not below the shortest lease, 10 s"),
    ({"heartbeat_limit": "50 ms"}, "heartbeat_period must not be above heartbeat_limit, got 0.1 s "
     "and 50 ms"),
    ({"fragment": "13441 B"}, "data_message: 13440 B hold no fragment of 13441 B; allowed: at "),
    ({"fragment": "999 B"}, "greater than or equal to 1000"),
    ({"data_message": "65401 B"}, "less than or equal to 65400"),
    ({"repeated_message": "65501 B"}, "less than or equal to 65500"),
    *(({field: 1_000_001}, "less than or equal to") for field in (
        "initial_announcements", "first_times", "responses", "depth"))])
def test_bad_numbers(params, complaint):
    with pytest.raises(ValidationError, match=re.escape(complaint)):
        dds(**params)
