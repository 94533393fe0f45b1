"""Links of rospy 1.15.15 where something fails, beside those of roscpp.

What rospy does was read in its sources, and seen with its own ``robust_connect_subscriber`` on
Linux 6.1: after "no route to host" it asks once, a second later; where that is answered it removes
the connection, where not, the connection stays in its list.
"""

import pytest
from graphs import S, listener, silent, talker
from ros_networks import SYNS_S, apart, control, says, seen
from ros_networks import one_master as net

from desim.middleware.ros1.links import RosLink
from desim.middleware.ros1.rospy_links import RospyLink

SYN_BYTES = 78


def calls_s(lost, kind, since_s=0.0):
    """The instants when b called a for ``kind``, once a connection."""
    return [row[0] for row in control(lost, kind)
            if row[1:3] == ("b", "a") and row[-1] == SYN_BYTES and row[0] > since_s]


def the_link(lost):
    links = lost.graph.middleware.processes.on(lost.graph.host("b").index)
    link, = links.subscriptions["/talk"].links.values()
    return link


def listed_anew(lost, at_s):
    """The master forgets the publisher at ``at_s`` and lists it again a second later, and tells b
    each time, as multimaster does after silence."""
    lists = lost.graph.middleware.processes.masters[lost.graph.host("m").index]
    a = lost.graph.middleware.processes.on(lost.graph.host("a").index).uri
    lost.at(round(at_s * S), lambda: lists.unregister_publisher("/talk", a))
    lost.at(round((at_s + 1) * S), lambda: lists.register_publisher("/talk", a))


def unlisted(client):
    """The messages that b hears of a, which is not listed from 2 to 3 s, and as what b sees a."""
    heard = []
    lost = net({"a": talker(says(1, 2.5, 4)), "b": listener(heard), "m": silent}, client=client)
    listed_anew(lost, 2)
    lost.run(5 * S)
    return [text for *_, text in heard], [state for *_, state in seen(lost)]


def test_rospy_keeps_an_open_link_whose_publisher_is_not_listed(monkeypatch):
    kept = ["1", "2.5", "4"], ["online"]
    assert unlisted("rospy") == kept
    assert unlisted("roscpp") == (["1", "4"], ["online", "offline", "online"])
    monkeypatch.setattr(RospyLink, "unlisted", RosLink.unlisted)
    assert unlisted("rospy") != kept


def broken():
    """Cut off from the first second to the 200th, b finds its link dead by keepalive. When it calls
    a from then on; the master lists a anew at 300 s."""
    lost = net({"a": talker(says(400)), "b": listener([]), "m": silent},
               [apart("a", start="1 s", until="200 s")], client="rospy")
    listed_anew(lost, 300)
    lost.run(420 * S)
    assert [row[:1] + row[2:] for row in seen(lost)[:2]] == [(0.14, "online"), (150.14, "offline")]
    return calls_s(lost, "tcpros", 1), calls_s(lost, "requestTopic", 1)


def test_rospy_makes_a_link_anew_when_the_master_lists_it_only(monkeypatch):
    """Twins: it tries again like roscpp, and asks like after a connection that did not open."""
    expected = pytest.approx([301.05], abs=0.03), pytest.approx([301.01], abs=0.03)
    assert broken() == expected
    with monkeypatch.context() as patch:
        patch.setattr(RospyLink, "_broke", RosLink._broke)
        assert broken() != expected
    monkeypatch.setattr(RospyLink, "_open", property(lambda self: False, lambda self, value: None),
                        raising=False)
    assert broken() != expected


def unreached(until_s, listed_s=200.0):
    """a is cut off once it has answered requestTopic (0.1 s), until ``until_s``; the master lists
    it anew. When b asks whether a still is a publisher, when it calls after that, and its link."""
    lost = net({"a": talker(says(230)), "b": listener([]), "m": silent},
               [apart("a", start="0.095 s", until=f"{until_s} s")], client="rospy")
    listed_anew(lost, listed_s)
    lost.run(240 * S)
    return (calls_s(lost, "getPublications"), calls_s(lost, "requestTopic", 1),
            calls_s(lost, "tcpros", 1), the_link(lost))


# b calls a from 0.1 s on. At 60.1 s it loses patience, TCP does not.
CALLED_S = [0.1 + after for after in SYNS_S if after > 0]


def test_a_link_that_was_not_reached_is_asked_for_once_and_then_left(monkeypatch):
    """The question of 61.1 s has 60 s, too. Nothing comes after it, although a is listed anew."""
    asked, requests, calls, link = unreached(150)
    assert asked == pytest.approx([61.1 + after for after in SYNS_S if after < 60])
    assert requests == []
    assert calls == pytest.approx(CALLED_S)
    assert link.stuck and not link.up
    monkeypatch.setattr(RospyLink, "_checked", lambda link, ok, topics: link._rest())
    *_, calls, link = unreached(150)
    assert calls != pytest.approx(CALLED_S) and link.up


def test_a_connection_that_opens_late_stays_silent(monkeypatch):
    """The question is answered, so b reads from the old socket, without a header. The SYN of 67.1 s
    comes through. A twin sends the header."""
    asked, requests, calls, link = unreached(61)
    assert asked == pytest.approx([61.1])
    assert requests == []
    assert calls == pytest.approx(CALLED_S)
    assert link._connection is not None and not link.up and not link.stuck
    monkeypatch.setattr(RospyLink, "_opened", RosLink._opened)
    assert unreached(61)[-1].up


def test_a_question_about_another_topic_is_answered_by_no(monkeypatch):
    """A twin takes any answer for a yes."""
    def link():
        lost = net({"a": talker([]), "b": listener([]), "m": silent},
                   [apart("a", start="0.095 s", until="61 s")], client="rospy")
        publications = lost.graph.middleware.processes.on(lost.graph.host("a").index).publications
        lost.at(50 * S, lambda: publications.pop("/talk"))
        lost.run(62 * S)
        return the_link(lost)
    assert link().stuck
    checked = RospyLink._checked
    monkeypatch.setattr(RospyLink, "_checked",
                        lambda link, ok, topics: checked(link, ok, (link.topic,)))
    assert not link().stuck


def without_a_route(monkeypatch, until_s):
    """As ``unreached``, where TCP finds no route at 3.1 s."""
    connect = RospyLink._connect

    def fails(link, _):
        connect(link, _)
        context = link.process.processes.context
        if context.now_ns < S:
            context.at(round(3.1 * S), link.process.host, lambda _: link._closed(
                link._connection, "unreachable"))

    with monkeypatch.context() as patch:
        patch.setattr(RospyLink, "_connect", fails)
        return unreached(until_s)


def test_a_link_without_a_route_is_made_anew_where_the_publisher_answers(monkeypatch):
    asked, requests, _, link = without_a_route(monkeypatch, 4)
    assert asked == pytest.approx([4.1])
    assert requests == pytest.approx([201.01], abs=0.02)
    assert link.up


def test_it_is_not_where_the_publisher_does_not_answer(monkeypatch):
    asked, requests, _, link = without_a_route(monkeypatch, 100)
    assert asked[0] == pytest.approx(4.1)
    assert requests == [] and link.stuck
