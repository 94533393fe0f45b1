"""TCP: whole logs of small cases."""

import pytest
from graphs import MS, S
from tcp_hosts import Losing, Pair, Takes, Word, link, partition

from desim.middleware.tcp.cubic import Cubic
from desim.middleware.tcp.loss_recovery import LossRecovery
from desim.middleware.tcp.parameters import TcpConstants
from desim.middleware.tcp.receiver import Receiver
from desim.middleware.tcp.retransmission import RetransmissionTimer

OPENED = [(0, "opened"), (0, "accepted")]  # where the network takes no time


def wire():
    """1 us a kilobit, 1 ms to the other side."""
    return link(rate="1 Gb/s", latency="1 ms")


def test_hello():
    """A handshake takes a round trip, and half a one more until the server knows. A message is
    acknowledged at once, which leaves no row."""
    pair = Pair(wire())
    pair.call()
    pair.at(10 * MS, pair.say, 7).run(S)
    assert pair.log == [(2_001_248, "opened"), (3_001_808, "accepted"), (11_001_360, "heard", 7)]
    assert pair.rows() == [
        (0, "control", "a", "b", "talk", 78), (1_000_624, "control", "b", "a", "talk", 78),
        (2_001_248, "control", "a", "b", "talk", 70), (10 * MS, "frame", "a", "b", 7, 170)]
    assert pair.net.graph.context.discovery_bytes == {"ack": 70, "talk": 226}
    assert pair.net.graph.context.discovery_frames == {"ack": 1, "talk": 3}


def test_who_knows_what_of_a_message():
    pair = Pair(wire())
    pair.call()
    known = []

    def note_state():
        connection = pair.connection
        known.append((len(connection.unacked(0)), len(connection.undelivered(0))))

    pair.at(10 * MS, pair.say, 7)
    for time_ns in 9 * MS, 11 * MS, 11_001_360 + 1, 12_001_919, 12_001_921:
        pair.at(time_ns, note_state)
    pair.run(S)
    assert known == [(0, 0), (1, 1), (1, 0), (1, 0), (0, 0)]


def test_what_is_said_before_the_connection_is_open_waits():
    pair = Pair(wire())
    pair.call()
    pair.say(1)
    pair.run(S)
    assert pair.log == [(2_001_248, "opened"), (3_001_808, "accepted"), (3_003_168, "heard", 1)]


def test_answers_carry_acknowledgements():
    """Once a host has answered what it had just heard (pingpong mode): the first message, its
    answer and the last one have acknowledgements of their own."""
    pair = Pair(wire())
    pair.call()
    for k in range(5):
        pair.at((100 + 20 * k) * MS, pair.say, k).at((110 + 20 * k) * MS, pair.say, 10 + k, 100, 1)
    pair.run(S)
    assert pair.net.graph.context.discovery_frames["ack"] == 3
    assert len(pair.heard()) == 10


def test_who_answers_lets_an_acknowledgement_wait_until_there_is_no_answer():
    """For 40 ms and a tick at most, once; then it goes at once again."""
    pair = Pair(wire())
    pair.call()
    pair.at(100 * MS, pair.say, 1).at(110 * MS, pair.say, 2, 100, 1)
    waits = []
    for time_ms in 200, 300:
        pair.at(time_ms * MS, pair.say, time_ms)
        for late_ms in 3, 41, 46:
            pair.at((time_ms + late_ms) * MS,
                    lambda: waits.append(len(pair.connection.unacked(0))))
    pair.run(S)
    assert waits == [1, 1, 0, 0, 0, 0]


def test_small_messages_wait_for_an_acknowledgement_unless_nodelay():
    """Nagle: one small segment on its way; what is said meanwhile goes as one segment, a round
    trip later. The frames of 100 B take 1.36 us, with another message of 1 ms in it 2.16 us, their
    acknowledgements 0.56 us."""
    for nodelay in False, True:
        pair = Pair(wire())
        pair.call(nodelay=nodelay)
        for k in range(6):
            pair.at((100 * MS + k * MS // 2), pair.say, k)
        pair.run(S)
        late_ns = [time_ns - 100 * MS - seq * MS // 2 for time_ns, seq in pair.heard()]
        if nodelay:
            assert late_ns == [1_001_360] * 6
        else:
            again_ns = 2 * MS + 1360 + 560
            more_ns = 2 * again_ns + 3 * 100 * 8
            assert [(row[0] - 100 * MS, row[4]) for row in pair.rows("frame")] == [
                (0, 0), *((again_ns, k) for k in range(1, 5)), (more_ns, 5)]


@pytest.mark.parametrize(("size_bytes", "sent_ns"), [(1448, 500_000), (1447, 2_001_920)])
def test_a_full_segment_does_not_wait_behind_a_small_one(size_bytes, sent_ns):
    """Nagle (RFC 896; Linux tcp_nagle_check): only segments of less than 1448 B of data wait."""
    pair = Pair(wire())
    pair.call()
    pair.at(100 * MS, pair.say, 1).at(100 * MS + MS // 2, pair.say, 2, size_bytes).run(S)
    assert [(row[0] - 100 * MS, row[4]) for row in pair.rows("frame")] == [(0, 1), (sent_ns, 2)]


def test_more_than_one_full_segment_is_acknowledged_at_once_by_who_answers_too():
    """And of a message of two segments, the second does not wait."""
    pair = Pair(wire())
    pair.call()
    pair.at(50 * MS, pair.say, 0).at(60 * MS, pair.say, 10, 100, 1)
    pair.at(100 * MS, pair.say, 1, 1605).at(200 * MS, pair.say, 2, 1448)
    waiting = []
    for time_ms in 102, 103, 202, 242, 247:
        pair.at(time_ms * MS, lambda: waiting.append(len(pair.connection.unacked(0))))
    pair.run(S)
    assert pair.heard()[2:] == [(101_013_960, 1), (201_012_144, 2)]
    assert waiting == [1, 0, 1, 1, 0]


def test_a_lost_train_is_sent_again_without_a_timeout():
    """Ten segments go as 3, 3, 3 and 1, a third of the window each: a round trip takes 6 ms. The
    first train is lost; the second one makes three duplicate acknowledgements; all of it is there
    after 1.5 round trips and something."""
    pair = Pair(link(rate="1 Gb/s", latency="3 ms"), [Losing(1, least_bytes=1000)],
                params={"burst": "1 ms"})
    pair.call()
    pair.at(100 * MS, pair.say, 1, 10 * 1448).run(S)
    again_ns = 106 * MS + 36_432 + 3 * 560
    assert pair.rows("frame", "lost") == [
        (100 * MS, "frame", "a", "b", 1, 4554), (100 * MS, "lost", "b", "a", 1, "lost"),
        *((100 * MS, "frame", "a", "b", 1, size) for size in (4554, 4554, 1518)),
        (again_ns, "frame", "a", "b", 1, 4554)]
    assert pair.heard() == [(again_ns + 36_432 + 3 * MS, 1)]


@pytest.mark.parametrize(("first", "trains"), [(1, [1, 9, 20]), (2, [2, 8, 4, 16])])
def test_a_third_of_the_window_is_worth_sending(first, trains):
    """Ten segments are on their way. The acknowledgement of one makes room for two of 11, which
    wait for more; that of two makes room for four of 12, a third (tcp_tso_should_defer)."""
    pair = Pair(link(rate="1 Gb/s", latency="20 ms"), params={"burst": "100 ms"})
    pair.call(nodelay=True)
    for k, segments in enumerate((first, 10 - first, 20)):
        pair.at((100 + k) * MS, pair.say, k, segments * 1448)
    pair.run(S)
    assert [row[5] / 1518 for row in pair.rows("frame") if row[2] == "a"] == trains


def test_a_window_that_is_lost_is_found_by_a_probe():
    """A round trip of 2 ms: ten segments are one train. Two round trips and 2 ms later, on the
    ticks of 4 ms, the last segment goes again; its acknowledgement shows that all before it is
    lost, and the window opens from one segment on, by one more a round trip (PRR)."""
    pair = Pair(wire(), [Losing(1, least_bytes=1000)])
    pair.call()
    pair.at(100 * MS, pair.say, 1, 10 * 1448).run(S)
    assert [(row[0] // MS, row[5] // 1518) for row in pair.rows("frame")] == [
        (100, 10), (112, 1), (114, 1), (116, 2), (118, 3), (120, 3)]


def nothing(*_):
    """A mechanism that is missing."""


@pytest.mark.parametrize(("known", "window", "threshold"), [(True, 11, None), (False, 2, 7)])
def test_a_timeout_is_taken_back_if_only_its_first_segment_was_lost(monkeypatch, known, window,
                                                                    threshold):
    """Of four messages the first is lost, and so are the acknowledgements of the others and the
    probe. The timeout's repetition is acknowledged with two that went once: all but the first had
    arrived (F-RTO, RFC 5682, 3.1, step 3b). Without F-RTO the window starts from one segment."""
    if not known:
        monkeypatch.setattr(LossRecovery, "_process_frto", nothing)
    pair = Pair(wire(), [Losing(3, 7), Losing(2, 3, 4, source=1)])
    pair.call(nodelay=True)
    for k in range(4):
        pair.at(100 * MS + k * MS // 10, pair.say, k)
    sender = pair.connection.sender(0)
    pair.run(S)
    assert [row[4] for row in pair.rows("frame")] == [0, 1, 2, 3, 3, 0]
    assert (sender.cwnd // 1448, sender.ssthresh // 1448) == (
        window, threshold or sender.constants.window_bytes // 1448)


@pytest.mark.parametrize(("known", "window"), [(True, 10), (False, 7)])
def test_a_probe_that_arrives_twice_was_not_needed(monkeypatch, known, window):
    """The acknowledgement of a message is lost. The probe's answer says that its bytes have come
    twice (D-SACK), so the window stays; without that it would shrink at the next message."""
    if not known:
        monkeypatch.setattr(RetransmissionTimer, "dsacked", nothing)
    pair = Pair(wire(), [Losing(2, source=1)])
    pair.call()
    pair.at(100 * MS, pair.say, 1).at(S, pair.say, 2).run(2 * S)
    assert [row[4] for row in pair.rows("frame")] == [1, 1, 2]
    assert pair.connection.sender(0).cwnd == window * 1448


@pytest.mark.parametrize(("waits", "again_ms"), [(True, 212), (False, 408)])
def test_one_segment_amid_a_message_waits_for_its_acknowledgement(monkeypatch, waits, again_ms):
    """The second of two segments is lost. The first is not the end of what was written, so its
    acknowledgement waits, and two are on their way: a probe goes after two round trips and 2 ms. If
    the first is acknowledged at once, one is, and it goes after 200 ms."""
    if not waits:
        monkeypatch.setattr(Receiver, "_deliver", lambda receiver: True)
    takes = Takes((1,), trains=[])
    pair = Pair(wire(), [takes])
    pair.call()
    pair.at(100 * MS, pair.say, 1, 40 * 1448).at(200 * MS, pair.say, 2, 2 * 1448)
    pair.at(150 * MS, lambda: takes._trains.append(len(takes.seen) + 1)).run(S)
    assert [row[0] // MS for row in pair.rows("frame") if row[4] == 2] == [200, again_ms]


def test_cubic_keeps_its_pace_within_a_tick():
    """A window of 10 shrinks to 7. By the curve 10 + 0.4 (t - K)^3, K = (3 / 0.4)^(1/3) s, whose
    distance from 10 counts in whole segments, it aims at 8: a segment more for each 7. That stays
    so for the tick, though 8 is reached; later it would take 800 (Linux bictcp_update)."""
    cubic = Cubic()
    assert cubic.recalc_ssthresh(10) == 7
    assert [cubic.growth(window, 7, 0, 300_000) for window in (7, 8, 9)] == [1, 1, 1]
    assert [cubic.growth(10, 7, k * 4 * MS, 300_000) for k in range(1, 8)] == [0] * 7


@pytest.mark.parametrize(("latency", "params", "trains"), [
    ("10 us", {}, [111]),
    ("10 us", {"near": "0 ns"}, [10, 20, 40, 41]),
    ("50 us", {}, [10, 20, 40, 41]),
    ("10 us", {"train": 44}, [44, 44, 23]),
    ("10 us", {"window": "64 kB"}, [44, 44, 23])])
def test_a_cable_is_too_short_for_a_window(latency, params, trains):
    """Up to a round trip of 0.1 ms, a map is one train and has one train of acknowledgements."""
    pair = Pair(link(rate="1 Gb/s", latency=latency), params=params)
    pair.call()
    pair.at(100 * MS, pair.say, 1, 160_113).run(S)
    assert [-(-row[5] // 1518) for row in pair.rows("frame")] == trains
    assert pair.net.graph.context.discovery_bytes["ack"] == 70 * sum(
        train // 2 or 1 for train in trains)


def test_a_loss_shows_that_a_near_host_has_to_be_asked_how_much_it_takes():
    """The first map is lost as a whole. A probe shows it after 16 ms, and the window opens from one
    segment on; it stays one for the second map."""
    pair = Pair(link(rate="1 Gb/s", latency="10 us"), [Losing(1, least_bytes=1000)])
    pair.call()
    pair.at(100 * MS, pair.say, 1, 160_113).at(900 * MS, pair.say, 2, 160_113).run(2 * S)
    first, second = ([-(-row[5] // 1518) for row in pair.rows("frame") if row[4] == seq]
                     for seq in (1, 2))
    assert first == [111, 1, *range(1, 15), 5] and sum(first) == 2 * 111
    assert len(second) > 1 and sum(second) == 111
    assert [seq for _, seq in pair.heard()] == [1, 2]


def test_a_partition_is_felt_until_the_next_timeout():
    """The probe comes after 200 ms, the timeout 200 ms after it, then it doubles; ticks of 4 ms,
    later of 32 ms, make them longer. Nagle lets the second message wait for the first."""
    pair = Pair(rules=[partition("1 s", "2.5 s")])
    pair.call()
    pair.at(S, pair.say, 1).at(2 * S, pair.say, 2).run(10 * S)
    assert pair.log == [*OPENED, (2656 * MS, "heard", 1), (2656 * MS, "heard", 2)]
    assert pair.rows("frame", "lost") == [
        *((t * MS, kind, *ends, 1, last) for t in (1000, 1204, 1408, 1824)
          for kind, ends, last in (("frame", "ab", 170), ("lost", "ba", "partitioned"))),
        (2656 * MS, "frame", "a", "b", 1, 170), (2656 * MS, "frame", "a", "b", 2, 170)]


@pytest.mark.parametrize(("more_ns", "closed_ms"), [(-1, 1824), (0, 1824), (1, 2656)])
def test_a_silence_as_long_as_agreed_ends_a_connection(monkeypatch, more_ns, closed_ms):
    """At the first timeout that is not less than so long after the first one (Linux
    retransmits_timed_out). The first is at 1408 ms, the second at 1824 ms."""
    monkeypatch.setattr(TcpConstants, "silence_ns", 416 * MS + more_ns)
    pair = Pair(rules=[partition("1 s", "100 s")])
    pair.call()
    pair.at(S, pair.say, 1).run(10 * S)
    assert pair.log == [*OPENED, (closed_ms * MS, "a closed", "timeout")]


def test_after_an_outage_timeouts_are_short_again():
    """The timer that was set for 51.2 s does not delay the next one."""
    pair = Pair(rules=[partition("1 s", "30 s"), Losing(2, least_bytes=150)],
                params={"tick": "0 ns"})
    pair.call()
    pair.at(S, pair.say, 1).at(54 * S, pair.say, 2).run(200 * S)
    assert pair.heard() == [(52_200 * MS, 1), (54_200 * MS, 2)]


def test_a_lost_acknowledgement_costs_a_copy_that_nobody_hears():
    pair = Pair(rules=[Losing(2, source=1)])  # after the SYN-ACK
    pair.call()
    pair.at(S, pair.say, 1).run(10 * S)
    assert pair.heard() == [(S, 1)]
    assert [row[0] for row in pair.rows("frame")] == [S, 1204 * MS]
    assert not pair.connection.unacked(0)


@pytest.mark.parametrize(("count", "opened_s"), [(0, 0), (1, 1), (4, 4), (5, 5), (6, 7), (7, 11)])
def test_a_lost_syn_is_sent_again(count, opened_s):
    """Four times after a second each, then after timeouts that double (Linux 6.5)."""
    pair = Pair(rules=[Losing(*range(1, count + 1))], params={"tick": "0 ns"})
    pair.call()
    assert pair.run(20 * S).log == [(opened_s * S, "opened"), (opened_s * S, "accepted")]


def test_a_lost_syn_ack_is_sent_again_for_the_second_syn_and_by_itself():
    pair = Pair(rules=[Losing(1, source=1)])
    pair.call()
    assert pair.run(10 * S).log == [(1024 * MS, "opened"), (1024 * MS, "accepted")]


def test_without_the_last_ack_the_first_data_opens_the_server_s_end():
    pair = Pair(rules=[Losing(2)])
    pair.call()
    pair.at(S // 2, pair.say, 1).run(10 * S)
    assert pair.log == [(0, "opened"), (S // 2, "accepted"), (S // 2, "heard", 1)]


def test_without_the_last_ack_the_server_asks_again():
    pair = Pair(rules=[Losing(2)])
    pair.call()
    assert pair.run(10 * S).log == [(0, "opened"), (1024 * MS, "accepted")]


def test_nobody_listens():
    pair = Pair()
    pair.call("other")
    assert pair.run(S).log == [(0, "a closed", "refused")]
    assert pair.at_rest()


def test_no_medium_in_common():
    pair = Pair()
    pair.net.graph.hosts[1].media.clear()
    pair.call()
    assert pair.run(S).log == [(0, "a closed", "unreachable")]
    assert pair.at_rest()


def test_close():
    """The FIN follows all data; the other end still may speak, to nobody."""
    pair = Pair(wire())
    pair.call()
    pair.at(S, pair.say, 1).at(S, pair.say, 2).at(S, pair.close, 0)
    pair.at(2 * S, pair.close, 1).run(1000 * S)
    assert [row[1:] for row in pair.log] == [("opened",), ("accepted",), ("heard", 1), ("heard", 2),
                                             ("b closed", "fin")]
    assert pair.at_rest()


def test_both_close_at_once():
    pair = Pair(wire())
    pair.call()
    pair.at(S, pair.close, 0).at(S, pair.close, 1).run(1000 * S)
    assert [row[1:] for row in pair.log] == [("opened",), ("accepted",)]
    assert pair.at_rest()


def test_a_call_that_is_taken_back():
    pair = Pair(wire())
    pair.call()
    pair.at(MS, pair.close, 0).run(1000 * S)
    assert pair.log == []
    assert [row[2:] for row in pair.rows()] == [
        ("a", "b", "talk", 78), ("b", "a", "talk", 78), ("a", "b", "talk", 70)]
    assert pair.at_rest()


def test_who_closed_refuses_data():
    pair = Pair(wire())
    pair.call()
    pair.at(S, pair.close, 0).at(S + 2 * MS, pair.say, 1, 100, 1)
    pair.at(S + 3 * MS, lambda: pair.note(len(pair.connection.undelivered(1)))).run(1000 * S)
    assert [row[1:] for row in pair.log] == [("opened",), ("accepted",), ("b closed", "fin"), (1,)]
    assert pair.at_rest()


def test_what_comes_behind_the_message_that_made_its_hearer_close_is_refused():
    pair = Pair(wire())
    pair.call()

    def speak():
        pair.connection.send(0, 100, lambda word: pair.close(1), Word(1))
        pair.say(2)

    pair.at(S, speak).at(2 * S, lambda: pair.note(len(pair.connection.undelivered(0))))
    pair.at(2 * S, pair.close, 0).run(1000 * S)
    assert [row[1:] for row in pair.log] == [("opened",), ("accepted",), ("a closed", "fin"), (0,)]
    assert pair.at_rest()


@pytest.mark.parametrize("speaker", [0, 1])
def test_a_peer_that_restarted_resets(speaker):
    pair = Pair()
    pair.call()
    lost = []
    pair.at(S, pair.stop, 1 - speaker).at(2 * S, pair.start, 1 - speaker)
    pair.connection.on_closed(speaker, lambda connection, reason: lost.append(
        (reason, [word.seq for word in connection.undelivered(speaker)])))
    if speaker:
        pair.at(S // 2, lambda: pair.connection.on_closed(1, lambda connection, reason: lost.append(
            (reason, [word.seq for word in connection.undelivered(1)]))))
    pair.at(3 * S, pair.say, 1, 100, speaker).run(10 * S)
    assert pair.log == OPENED and lost == [("reset", [1])]
    assert pair.at_rest()


def test_a_host_that_stops_takes_its_timers_with_it():
    pair = Pair(rules=[partition("0.5 s", "1 h")])
    pair.call()
    pair.at(S, pair.say, 1).at(2 * S, pair.stop, 0).at(3 * S, pair.start, 0).run(100 * S)
    assert pair.log == OPENED
    assert pair.rows("frame")[-1][0] == 1824 * MS


def test_a_server_that_stops_in_the_handshake_is_called_by_the_next_syn():
    pair = Pair(wire())
    pair.call()
    pair.at(MS + 1, pair.stop, 1).at(500 * MS, pair.start, 1)
    pair.at(500 * MS, lambda: pair.tcp.listen(1, "talk", pair._accept)).run(10 * S)
    assert [row[1:] for row in pair.log] == [("opened",), ("accepted",)]


@pytest.mark.parametrize(("asks", "pieces", "count"), [
    ("writable", 26, 16), ("takes", 26, 36), ("takes", 22, 32)])
def test_the_send_buffer_has_room_again(asks, pieces, count):
    """46 080 B of memory at first, with 832 B for each of eleven pieces. poll() has a third of it
    free, and says so again after the first acknowledgements; write() goes on until it is full, and
    fills the last piece (Linux 6.18: 36 segments, or 32 where the peer has offered no more than
    64 kB)."""
    pair = Pair(wire(), params={"piece_segments": pieces})
    pair.call()

    def fill():
        said = 0
        while getattr(pair.connection.sender(0), asks):
            pair.say(said, 1448)
            said += 1
        pair.note(said)
        pair.connection.sender(0).when_writable(lambda: pair.note("writable"))

    pair.at(S, fill).run(10 * S)
    log = [row for row in pair.log if row[1] in (count, "writable")]
    assert log == [(S, count), (log[1][0], "writable")]
    assert 2 * MS < log[1][0] - S < 6 * MS
    assert [seq for _, seq in pair.heard()] == list(range(count))


def test_discovery_and_data_in_one_train_are_counted_apart():
    pair = Pair(wire())
    pair.call()
    pair.connection.send(0, 500, lambda _: pair.note("header"), None, "header")
    pair.say(1, 300)
    pair.run(S)
    assert [row[1:] for row in pair.rows("frame", "control")[-2:]] == [
        ("control", "a", "b", "header", 570), ("frame", "a", "b", 1, 300)]
    assert pair.net.graph.context.discovery_bytes["header"] == 570


# --------------------------------------------------------------------- what is written in pieces


def written(pair, writes, size_bytes):
    pair.connection.send(0, size_bytes, lambda word: pair.note("heard", word.seq), Word(1), "word",
                         writes)


@pytest.mark.parametrize(("nodelay", "train"), [(True, (7, 703 + 7 * 70)), (False, (1, 703 + 70))])
def test_without_nagle_each_write_is_a_packet_of_one_train(nodelay, train):
    takes = Takes((), ())
    pair = Pair(link(latency="1 ms"), [takes])
    pair.call(nodelay=nodelay)
    pair.at(S, written, pair, 7, 703).run(2 * S)
    assert train in takes.seen
    assert [number for _, number in pair.heard()] == [1]
    assert not pair.connection.unacked(0)


def test_of_a_train_of_writes_only_what_was_lost_goes_again():
    takes = Takes((2, 3), trains=(4,))  # behind the handshake
    pair = Pair(link(latency="1 ms"), [takes])
    pair.call(nodelay=True)
    pair.at(S, written, pair, 7, 703).run(3 * S)
    again = [size_bytes for _, size_bytes in takes.seen[4:] if size_bytes > 150]
    assert again == [401 - 200 + 70]
    assert [number for _, number in pair.heard()] == [1]


def test_writes_that_do_not_all_fit_into_the_window_are_cut_as_tcp_likes():
    takes = Takes((), ())
    pair = Pair(link(latency="1 ms"), [takes])
    pair.call(nodelay=True)
    pair.at(S, written, pair, 500, 50_000).run(3 * S)
    assert max(segments for segments, _ in takes.seen) < 50
    assert [number for _, number in pair.heard()] == [1]
