"""A master on each host: how they meet, notice silence, and copy what the others know."""

import pytest
from configured import configured
from graphs import Net, S, listener, silent, talker
from ros_networks import AT_ONCE, apart, beliefs, control, master, says, seen, stop
from tcp_hosts import Losing

from desim.errors import InputError
from desim.middleware.multimaster.discovery import RemoteMaster
from desim.middleware.multimaster.multimaster import Multimaster
from desim.middleware.multimaster.sync import Sync
from desim.middleware.ros1.xmlrpc import XmlRpcCall
from netmodels.ideal import Ideal
from netmodels.rules.outage import Outage

GROOVY, NOETIC = "fkie_1_3_groovy", "fkie_1_3"


def net(nodes, preset, rules=(), **params):
    params = {**AT_ONCE, "start_jitter": "0 s", "sync_delay": "0 s"} | params
    params["tcp"] = {"tick": "0 ns", "arp": "static"} | params.get("tcp", {})
    return Net(nodes, Ideal(Ideal.Params(delay="10 ms")), rules,
               middleware=Multimaster(configured(Multimaster.Params, preset=preset, **params)))


def registered(net, host, side="publishers"):
    """Host indices by topic as a host's master has them."""
    return {topic: list(known) for topic, known in getattr(master(net, host), side).items()
            if known}


# ------------------------------------------------------------------------------------ cold start


def test_the_whole_log_of_a_cold_start():
    """Heartbeats at 0 s; 0.1 s later each asks the other who it is. What nodes registered by 1 ms
    is noticed by the look at 1 s and told by the heartbeat of 1 s; a's is fetched by b, and b's by
    a. Each call has a connection of its own; the first fetch comes between two questions after
    methods, and checksums are asked for behind each. a's sync then makes b ask a."""
    cold = net({"a": talker([]), "b": listener([])}, GROOVY).run(S * 5 // 4)
    rows = [row for row in control(cold) if row[3] not in ("ack", "heartbeat")]
    calls = {kind: [row for row in rows if row[3] == kind] for kind in ("masterContacts",
                                                                        "masterInfo")}
    assert [row for row in calls["masterContacts"] if row[1] == "a"] == [
        (0.11, "a", "b", "masterContacts", 78), (0.12, "a", "b", "masterContacts", 78),
        (0.13, "a", "b", "masterContacts", 70), (0.13, "a", "b", "masterContacts", 370),
        (0.14, "a", "b", "masterContacts", 570), (0.15, "a", "b", "masterContacts", 71),
        (0.16, "a", "b", "masterContacts", 71)]
    # One registration on each side: 345 + 162 B; before there is any, 345 B.
    assert [(row[0], row[-1]) for row in calls["masterInfo"] if row[1] == "a" and row[-1] > 78] == [
        (0.21, 376), (0.22, 345 + 70), (1.03, 376), (1.04, 345 + 162 + 70)]
    asked = [(row[0], row[3], row[-1]) for row in rows if row[1] == "a" and row[-1] > 78
             and row[3] in ("listMethods", "md5Sums", "publisherUpdate")]
    assert asked == [(0.17, "listMethods", 334), (0.18, "listMethods", 865),
                     (0.25, "listMethods", 334), (0.26, "listMethods", 865),
                     (0.29, "md5Sums", 360 + 70), (0.3, "md5Sums", 278 + 70),
                     (1.07, "md5Sums", 360 + 48 + 70), (1.071, "publisherUpdate", 459 + 56 + 70),
                     (1.08, "md5Sums", 278 + 158 + 70)]
    assert seen(cold) == [(0.15, "a", "online")]
    assert seen(cold, "a") == [(0.15, "b", "online")]
    # Own master 1 ms, b's list another one.
    assert beliefs(cold) == [(1.052, "b", "a", "/talk", 1)]
    assert registered(cold, "b") == {"/talk": [0]}
    assert registered(cold, "a", "subscribers") == {"/talk": [1]}


def test_robots_talk_and_nobody_is_the_centre():
    heard = []
    fleet = net({"a": talker([(5 * S, "one"), (20 * S, "two")]), "b": listener(heard),
                 "c": silent}, GROOVY)
    stop(fleet, "c", 10)
    fleet.run(30 * S)
    assert [text for *_, text in heard] == ["one", "two"]


def test_heartbeats_cost_what_they_should():
    """24 B of payload and 46 B of headers, twice a second; noetic: three with a request each at the
    start, those that tell of changes at the first look and at 1 s, then one every 50 s."""
    quick = net({"a": silent, "b": silent}, GROOVY).run(100 * S - 1)
    assert quick.graph.context.discovery_bytes["heartbeat"] == 2 * 200 * 70
    slow = net({"a": talker([]), "b": silent}, NOETIC).run(100 * S - 1)
    beats = [row[0] for row in control(slow, "heartbeat") if row[1] == "a"]
    # Each request is answered by the other.
    assert beats == [0, 0, 0, 0.01, 1, 1, 1, 1.01, 2, 2, 2.01, 50]


def test_each_heartbeat_may_go_to_named_hosts_by_unicast():
    named = net({"a": silent, "b": silent, "c": silent}, GROOVY, multicast=False,
                robot_hosts=["a", "b"]).run(S // 4)
    assert sorted(row[1:3] for row in control(named, "heartbeat")) == [
        ("a", "b"), ("b", "a"), ("c", "a"), ("c", "b")]
    with pytest.raises(InputError, match=r"robot_hosts.0: no host 'x'.*allowed: a, b"):
        net({"a": silent, "b": silent}, GROOVY, robot_hosts=["x"])


@pytest.mark.parametrize("preset", [GROOVY, NOETIC])
def test_who_does_not_answer_is_asked_again(preset):
    """Cut off after the first heartbeat: the call of 0.11 s fails after 10 s, and so does the next
    one. The third one is answered."""
    def check(**params):
        shy = net({"a": silent, "b": silent}, preset, [
            apart("a", start="50 ms", until="29.5 s")], **params).run(40 * S)
        calls = [row[0] for row in control(shy, "masterContacts") if row[1] == "b"]
        assert calls[::7][:3] == pytest.approx([0.11, 15.11, 30.11])
        assert seen(shy) == [(pytest.approx(30.15), "a", "online")]
    check()
    with pytest.raises(AssertionError):
        check(contact_retry="4.75 s")
    with pytest.raises(AssertionError):
        check(contact_timeout="9.5 s")


def test_nobody_waits_for_ever_for_the_answer_of_the_dead():
    """a acknowledges the question of 0.11 s, its answer is lost, and it restarts at 5 s."""
    shy = net({"a": silent, "b": silent}, GROOVY, [Losing(1, 2, 3, 4, 5, least_bytes=570)])
    stop(shy, "a", 2, 5)
    shy.run(20 * S)
    assert seen(shy) == [(pytest.approx(15.15), "a", "online")]


# -------------------------------------------------------------------------------------- silence


def silence(preset, **params):
    """The whole log from 100 s on of two hosts, of which a falls silent in the middle between two
    looks of b; times in s."""
    two = net({"a": silent, "b": silent}, preset, **params)
    stop(two, "a", 100.25)
    two.run(450 * S)
    return sorted((row[0] / S, *row[1:]) for row in two.rows() if row[0] >= 100 * S)


def noticed_s(preset, **params):
    """The times at which b takes a for offline, and forgets it."""
    return [(row[0], row[4]) for row in silence(preset, **params) if row[1] == "sees"]


def beat(time_s, of="b", to="medium/lan"):
    return (time_s, "control", of, to, "heartbeat", 70)


STOP = [beat(100, "a"), (100.25, "host_stopped", "a", 0, 0, 0)]
REMOVED = (401, "sees", "b", "a", "removed", 0)
# A look finds what came in the 5 s before it: nine of ten beats, then two less each time.
QUICK = sorted([*STOP, *(beat(100 + k / 2) for k in range(701)),
                *((time_s, "link_quality", "b", "a", percent, 0) for time_s, percent in (
                    (101, 90), (102, 70), (103, 50), (104, 30), (105, 10), (106, 0))),
                (108, "sees", "b", "a", "offline", 0), REMOVED])
SLOW = sorted([*STOP, *(beat(100 + 50 * k) for k in range(8)),
               *(beat(161 + k, to="a") for k in range(5)), (166, "sees", "b", "a", "offline", 0),
               REMOVED])


def test_quick_heartbeats_notice_after_seven_seconds():
    """fkie of the paper's time: the last beat came at 100.01 s; 1.4 * 5 s later it is late, and the
    next look is at 108 s. After 300 s it is forgotten."""
    assert silence(GROOVY) == QUICK
    expected = [(108, "offline"), (401, "removed")]
    assert noticed_s(GROOVY) == expected
    assert noticed_s(GROOVY, timeout_factor=1.4 * 1.15) != expected
    assert noticed_s(GROOVY, timeout_factor=1.4 / 1.15) != expected
    assert noticed_s(GROOVY, remove_after="285 s") != expected
    assert noticed_s(GROOVY, heartbeat="1 Hz", timeout_factor=10) == [(151, "offline"),
                                                                      (401, "removed")]


def test_slow_heartbeats_notice_after_sixty_five_seconds():
    """The last beat came at 100.01 s; from 60 s of silence on it is asked once a second, and with
    the fifth question unanswered it is offline at the next look."""
    assert silence(NOETIC) == SLOW
    expected = [(166, "offline"), (401, "removed")]
    assert noticed_s(NOETIC) == expected
    assert noticed_s(NOETIC, active_request_after="63 s") != expected
    assert noticed_s(NOETIC, offline_after_requests=6) != expected
    assert noticed_s(NOETIC, active_request_after="0 s") == [(401, "removed")]


def test_masters_that_judge_otherwise_notice_at_other_times(monkeypatch):
    """Twins: offline as soon as no heartbeat is left in the window, or without being asked."""
    judge = RemoteMaster.verdict

    def by_quality(remote, now_ns, watch, params):
        verdict = judge(remote, now_ns, watch, params)
        return "offline" if verdict is None and remote.known and not remote._beats else verdict

    def unasked(remote, now_ns, watch, params):
        verdict = judge(remote, now_ns, watch, params)
        return "offline" if verdict == "request" else verdict

    monkeypatch.setattr(RemoteMaster, "verdict", by_quality)
    assert noticed_s(GROOVY) == [(107, "offline"), (401, "removed")]
    assert silence(GROOVY) != QUICK
    monkeypatch.setattr(RemoteMaster, "verdict", unasked)
    assert noticed_s(NOETIC) == [(161, "offline"), (401, "removed")]
    assert silence(NOETIC) != SLOW


def test_slow_heartbeats_are_not_counted_and_a_question_is_answered():
    """0.02 Hz is 0 on the wire. a is cut off for 12 s, and its heartbeat of 150 s with it; asked at
    161 s, it answers, and never was offline."""
    asked = net({"a": silent, "b": silent}, NOETIC, [apart("a", start="149 s", until="155 s")])
    asked.run(190 * S)
    assert seen(asked) == [(0.15, "a", "online")]
    requests = [row for row in control(asked, "heartbeat") if row[1] == "b" and row[0] > 155]
    assert [row[0] for row in requests] == [161, 161.01]  # one's own, and the answer to a's
    assert asked.rows("link_quality") == []


def test_link_quality_is_the_share_of_heartbeats_that_came():
    """Ten in 5 s are 100 %. Cut off from 20 s on, two are missing with each look."""
    cut = net({"a": silent, "b": silent}, GROOVY, [apart("a", start="20.1 s")]).run(40 * S)
    assert [(row[0] / S, row[4]) for row in cut.rows("link_quality") if row[2] == "b"] == [
        (1, 20), (2, 40), (3, 60), (4, 80), (5, 100),
        (21, 90), (22, 70), (23, 50), (24, 30), (25, 10), (26, 0)]


def test_whoever_leaves_is_removed_at_once():
    gone = net({"a": talker([]), "b": listener([])}, GROOVY, leave=True)
    stop(gone, "a", 10.25)
    gone.run(20 * S)
    assert seen(gone) == [(0.15, "a", "online"), (10.26, "a", "removed")]
    assert registered(gone, "b") == {}
    assert beliefs(gone)[-1] == (10.262, "b", "a", "/talk", 0)


# ----------------------------------------------------------------------------------------- sync


def haunted():
    """a dies at 10.25 s. What b has registered and how many ghosts there are at 305 s and at 312 s,
    and all that is believed and seen at b."""
    ghost = net({"a": talker([]), "b": listener([])}, GROOVY)
    stop(ghost, "a", 10.25)
    states = []
    for until_s in 305, 312:
        ghost.run(until_s * S)
        states.append((registered(ghost, "b"), ghost.graph.context.beliefs.ghosts))
    return states, beliefs(ghost), seen(ghost)


HAUNTED = ([({"/talk": [0]}, 1), ({}, 0)],
           [(1.052, "b", "a", "/talk", 1), (311.002, "b", "a", "/talk", 0)],
           [(0.15, "a", "online"), (18, "a", "offline"), (311, "a", "removed")])


def test_offline_masters_keep_their_registrations_until_they_are_removed():
    """Ghosts from 10 s to 311 s, when 300 s of silence have passed."""
    assert haunted() == HAUNTED


@pytest.mark.parametrize(("news", "states"), [
    ({"offline": "removed"}, [({}, 0), ({}, 0)]),
    ({"removed": "offline"}, [({"/talk": [0]}, 1)] * 2)])
def test_ghosts_end_otherwise_where_sync_takes_one_for_the_other(monkeypatch, news, states):
    """Twins: what is offline is struck off at once, or nothing ever is."""
    notify = Sync.notify
    monkeypatch.setattr(Sync, "notify", lambda sync, what, remote: notify(
        sync, news.get(what, what), remote))
    found, _, sees = haunted()
    assert (found, sees) == (states, HAUNTED[2])
    assert found != HAUNTED[0]


def test_a_reconnect_tears_all_links_down_and_builds_them_anew():
    """Apart from 20.1 s to 40.1 s: offline at 28 s, online with the beat of 40.5 s. b forgets a and
    copies it afresh; the link of 1 s, which had outlived the cut, is closed and made again."""
    def check(expected, **params):
        parted = net({"a": talker([]), "b": listener([])}, GROOVY,
                    [apart("a", start="20.1 s", until="40.1 s")], **params)
        parted.run(60 * S)
        assert seen(parted) == [(0.15, "a", "online"), (28, "a", "offline"),
                               (40.51, "a", "online")]
        assert [row[0] for row in beliefs(parted) if row[1] == "b"] == expected
        links = [row[0] for row in control(parted, "tcpros") if row[1] == "b" and row[-1] == 78]
        assert len(links) == 1 + (len(expected) > 1)

    # Forgotten 2 ms after the beat; the call is a round trip and the answer's way to the nodes.
    check([1.052, 40.512, 40.552])
    check([1.052], resync_on_reconnect=False)
    check([1.052], resync_on_reconnect_timeout="13 s")
    check([1.052, 40.512, 40.552], resync_on_reconnect_timeout="12 s")
    with pytest.raises(AssertionError):
        check([1.052, 40.512, 40.552], timeout_factor=1.4 * 1.15)


def test_a_restarted_robot_is_copied_with_its_new_address():
    """a is back before anybody notices. Its next state has another address, and b asks there."""
    heard = []
    back = net({"a": talker([(2 * S, "old"), (20 * S, "new")]), "b": listener(heard)}, GROOVY)
    stop(back, "a", 10, 12)
    back.run(30 * S)
    assert [text for *_, text in heard] == ["old", "new"]
    assert [state for _, _, state in seen(back)] == ["online"]


def test_a_change_in_the_meantime_puts_a_fetch_off():
    """a subscribes to one more topic each second. Of 3 s at most, drawn anew five times, or never
    (twin: as often as it likes)."""
    def fetches(restarts):
        def growing(node):
            for k in range(30):
                node.after(k * S, lambda k: node.subscribe(f"/t{k}", print), k)
        grown = net({"a": growing, "b": silent}, GROOVY, sync_delay="3 s", sync_restarts=restarts)
        grown.run(35 * S)
        return len([row for row in control(grown, "masterInfo")
                    if row[1] == "b" and row[-1] == 376])
    counts = [fetches(restarts) for restarts in (0, 5, 50)]
    assert counts == sorted(counts, reverse=True)
    assert counts[0] > counts[1]


def test_what_was_left_out_is_fetched_by_the_next_poll():
    """a's state cannot be fetched at 1 s: b's call to it is lost for good, while heartbeats are
    multicast and come. The patience of 20 s ends at 21 s, and the look at 30 s tries again."""
    lame = net({"a": talker([]), "b": listener([])}, GROOVY,
               [Outage(Outage.Params(hosts=["a"], **{"from": "1.015 s", "until": "1.4 s"}))],
               sync_timeout="0.3 s")
    lame.run(40 * S)
    fetches = [row[0] for row in control(lame, "masterInfo") if row[1] == "b"
               and row[-1] in (376, 78)]
    assert [round(time_s) for time_s in fetches][-2:] == [30, 30]
    assert beliefs(lame)[0][0] == pytest.approx(30.042)


def test_topics_may_be_left_out():
    quiet = net({"a": talker([], topic="/diagnostics"), "b": listener([], topic="/diagnostics")},
                GROOVY, ignore_topics=["/diag*"]).run(5 * S)
    assert beliefs(quiet) == []


def test_the_delay_of_a_fetch_is_drawn_between_zero_and_two_seconds():
    many = net({f"h{i}": silent for i in range(12)}, GROOVY, sync_delay="2 s").run(3 * S)
    starts = {}
    for time_s, who, whom, _, size_bytes in control(many, "listMethods"):
        if size_bytes == 264 + 70:
            starts.setdefault((who, whom), time_s - 0.17)
    first = sorted(starts.values())
    assert len(first) == 12 * 11
    assert 0 <= first[0] < first[-1] <= 2.001
    assert sum(first) / len(first) == pytest.approx(1, abs=0.15)


# ------------------------------------------------------------------------- lists that come too late


def heard_by_b(*stops_s):
    """The seconds at which a said what b heard. b subscribes at 1.5 s; c only looks on. c's sync
    calls b at 2.07 s, when c is cut off until 3.9 s. a stops at these times, for half a second."""
    heard = []
    late = net({"a": talker(says(*range(60))), "c": silent, "b": lambda node: node.after(
        S * 3 // 2, lambda _: listener(heard)(node), None)}, GROOVY,
        [apart("c", start="2.065 s", until="3.9 s")])
    for stop_s in stops_s:
        stop(late, "a", stop_s, stop_s + 0.5)
    late.run(60 * S)
    return [int(text) for *_, text in heard]


def test_a_call_that_sync_has_given_up_still_tells_its_old_list(monkeypatch):
    """At 4.1 s c's master tells b of a's new address. At 5.051 s sync ends its call, and only then
    TCP brings it to b: it has a's old address, which refuses. Nobody tells b anew until a's
    registration changes. Twin: a call that was given up never arrives."""
    assert heard_by_b() == [*range(2, 60)]
    assert heard_by_b(2.5) == [2, 4, 5]
    assert heard_by_b(2.5, 29.5) == [2, 4, 5, *range(31, 60)]
    monkeypatch.setattr(XmlRpcCall, "_hang_up", lambda call, connection:
                        connection.end(call.client).vanish())
    assert heard_by_b(2.5) == [2, *range(4, 60)]


def test_sync_tells_the_list_of_its_multicall(monkeypatch):
    """b subscribes to 30 topics of c, of which c's sync informs it for 1.2 s, one after another. a
    publishes the last one, too, which its own master and c's tell b in the meantime; sync then
    tells b the old list. Twin: it tells that of the moment."""
    def known_of_a():
        thirty = net({
            "a": lambda node: node.after(S * 3 // 2, lambda _: node.advertise("/t29"), None),
            "b": lambda node: [node.subscribe(f"/t{k}", print) for k in range(30)],
            "c": lambda node: [node.advertise(f"/t{k}") for k in range(30)]}, GROOVY).run(60 * S)
        assert registered(thirty, "b")["/t29"] == [2, 0]
        return [(time_s, known) for time_s, who, whom, _, known in beliefs(thirty)
                if (who, whom) == ("b", "a")]

    assert known_of_a() == [(1.681, 1), (2.241, 0)]
    inform = Sync._update_publishers

    def anew(sync, updates):
        registry = sync._processes.masters[sync._host].registry
        inform(sync, [(topic, uri, registry.of(registry.publishers, topic))
                      for topic, uri, _ in updates])

    monkeypatch.setattr(Sync, "_update_publishers", anew)
    assert known_of_a() == [(1.681, 1)]
