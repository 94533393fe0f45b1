"""Real frames on their way through a medium, from the TAP of one host to those of others."""

from __future__ import annotations

import os
import socket
from collections import Counter

import pytest
from ethernet import EVERYBODY, frame, tcp, udp
from graphs import MS, Net, S, silent
from hypothesis import given, settings
from hypothesis import strategies as st

from desim import plugins
from desim.loop.addresses import Address
from desim.loop.gateway import STACK_NS, Gateway
from desim.loop.taps import MAX_FRAME_BYTES, HostTap
from desim.network.scoped_rule import scoped
from netmodels.ideal import Ideal
from netmodels.switch import Switch

HOSTS = ("a", "b", "c")
NOBODY = b"\x52\x54\x00\x12\x34\x56"


class Line:
    """A TAP of one host, and what its programs send and get."""

    def __init__(self, host, queue=None):
        tap, self.programs = socket.socketpair(socket.AF_UNIX, socket.SOCK_DGRAM)
        self._tap = tap
        for end in tap, self.programs:
            end.setblocking(False)
        if queue is not None:
            tap.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, queue)
        self.tap = HostTap(Address(0, host), tap.fileno())

    def received(self):
        got = []
        while True:
            try:
                got.append(self.programs.recv(MAX_FRAME_BYTES))
            except BlockingIOError:
                return got

    def close(self):
        self._tap.close()
        self.programs.close()


class Plant:
    """Three hosts with a TAP each on one medium, and when their frames were due."""

    def __init__(self, model=None, rules=(), made=Gateway, queue=None, seed=0, lines=HOSTS):
        self.net = Net(dict.fromkeys(HOSTS, silent), model or Ideal(Ideal.Params(delay="1 ms")),
                       rules, seed=seed)
        self.lines = [Line(HOSTS.index(host), queue) for host in lines]
        self.due_ns = []
        self.gateway = made(self.net.graph, self.net.medium, [line.tap for line in self.lines],
                            self.due_ns.append)

    def __enter__(self):
        return self

    def __exit__(self, *error):
        for line in self.lines:
            line.close()

    def send(self, host, *frames, at_ns=0):
        def take():
            for sent in frames:
                self.lines[host].programs.send(sent)
            self.gateway.take(self.lines[host].tap, at_ns)
        self.net.at(at_ns, take)

    def received(self):
        return [line.received() for line in self.lines]

    def account(self):
        """(published, intended, delivered, dropped) of each topic that has some."""
        return {name: (topic.counts.published, topic.counts.intended, topic.counts.delivered,
                       topic.counts.dropped) for name, topic in self.net.graph.topics.items()
                if topic.counts.published}


def to(host, *what, source=0):
    return frame(udp(*what), to=Address(0, host).mac, source=source)


def rule(name, **params):
    found = plugins.parameters("rule", name)(**params)
    return scoped(plugins.load("rule", name)(found), found)


def test_a_frame_to_a_host_reaches_it_as_it_was_sent_and_nobody_else():
    sent = to(1, 7400, 7410, b"hello")
    with Plant() as plant:
        plant.send(0, sent)
        plant.net.run(S)
        assert plant.received() == [[], [sent], []]
        assert plant.account() == {"/udp/7400": (1, 1, 1, {})}
        assert (plant.gateway.frames, plant.gateway.strays) == (1, 0)
        (due_ns,) = plant.due_ns
        assert MS <= due_ns < MS + STACK_NS
        assert plant.net.medium.tx_bytes == [64, 0, 0]  # a short frame is padded
        assert [row[1:3] for row in plant.net.rows("sent", "frame", "delivered")] == [
            ("sent", "a"), ("frame", "a"), ("delivered", "b")]


@pytest.mark.parametrize("group", [EVERYBODY, b"\x01\x00\x5e\x00\x00\xfb"])
def test_a_frame_to_a_group_reaches_all_others(group):
    sent = frame(udp(7400, 7400), to=group, source=1)
    with Plant() as plant:
        plant.send(1, sent)
        plant.net.run(S)
        assert plant.received() == [[sent], [], [sent]]
        assert plant.account() == {"/udp/7400": (2, 2, 2, {})}
        assert plant.gateway.frames == 1


@pytest.mark.parametrize("where", [NOBODY, Address(0, 0).mac, Address(0, 7).mac])
def test_a_frame_to_nobody_is_counted_as_that_alone(where):
    with Plant() as plant:
        plant.send(0, frame(udp(1, 2), to=where))
        plant.net.run(S)
        assert plant.received() == [[], [], []]
        assert plant.account() == {}
        assert (plant.gateway.frames, plant.gateway.strays) == (1, 1)
        ((_, _, *row),) = plant.net.rows("frame")
        assert row == ["a", "a", 0, 64]  # the digest knows it


def test_a_host_without_an_interface_to_the_medium_gets_nothing():
    with Plant(lines=("a", "b")) as plant:
        plant.send(0, to(2, 1, 2), frame(udp(1, 2)))
        plant.net.run(S)
        assert [len(got) for got in plant.received()] == [0, 1]
        assert (plant.gateway.frames, plant.gateway.strays) == (2, 1)


class Unordered(Gateway):
    """Its delays of one host's frames are independent of each other."""

    def take(self, tap, now_ns):
        self._last_ns[tap.address.host] = 0
        super().take(tap, now_ns)


FRAMES = st.lists(st.tuples(st.integers(0, 2), st.integers(0, 400_000)), min_size=2, max_size=30)


def in_order(frames, made=Gateway):
    with Plant(made=made) as plant:
        for number, (host, at_ns) in enumerate(sorted(frames, key=lambda sent: sent[1])):
            plant.send(host, frame(udp(9, 9, bytes([number])), source=host), at_ns=at_ns)
        plant.net.run(S)
        return all(sorted(numbers) == numbers for got in plant.received()
                   for source in range(3)
                   for numbers in [[one[-1] for one in got if one[11] == source]])


@given(FRAMES)
@settings(max_examples=25)
def test_frames_of_one_host_stay_in_order_whatever_their_delays(frames):
    assert in_order(frames)


def test_without_that_they_would_not():
    assert not in_order([(0, 10_000 * number) for number in range(30)], Unordered)


@given(FRAMES, st.integers(0, 3))
@settings(max_examples=25)
def test_every_frame_has_one_fate_at_every_receiver(frames, seed):
    with Plant(Switch(Switch.Params(rate="10 Mb/s", buffer="2 kB")),
               [rule("loss", probability=0.3), rule("duplication", probability=0.2)],
               seed=seed) as plant:
        for host, at_ns in frames:
            plant.send(host, frame(udp(9, 9, bytes(600)), source=host), at_ns=at_ns)
        plant.net.run(S)
        counts = plant.net.counts("/udp/9")
        assert plant.gateway.frames == len(frames) and not plant.gateway.strays
        assert counts.intended == 2 * len(frames)
        assert counts.in_flight == 0
        assert sum(map(len, plant.received())) == counts.delivered + counts.repeated
        assert len(plant.due_ns) == counts.delivered


def test_a_rule_by_topic_cuts_its_port_and_leaves_the_others():
    cut, kept = to(1, 40_000, 11_311), frame(tcp(40_000, 11_311), to=Address(0, 1).mac)
    with Plant(rules=[rule("loss", probability=1.0, topics=["/udp/11311"])]) as plant:
        plant.send(0, cut, kept)
        plant.net.run(S)
        assert plant.received()[1] == [kept]
        assert plant.account() == {"/udp/11311": (1, 1, 0, {"random_loss": 1}),
                                   "/tcp/11311": (1, 1, 1, {})}


def test_a_host_that_is_down_sends_and_gets_nothing():
    with Plant() as plant:
        plant.net.at(0, lambda: plant.net.graph.host("b").stop())
        plant.send(0, to(1, 1, 2), at_ns=MS)
        plant.send(1, to(0, 3, 4, source=1), at_ns=MS)
        plant.net.run(S)
        assert plant.received() == [[], [], []]
        assert plant.account() == {"/udp/1": (1, 1, 0, {"host_down": 1})}
        assert (plant.gateway.frames, plant.gateway.strays) == (2, 1)


def test_what_an_interface_has_no_room_for_is_lost_as_such():
    sent = frame(udp(9, 9, bytes(1400)))
    with Plant(queue=4096) as plant:
        for at_ms in range(100):
            plant.send(0, sent, at_ns=at_ms * MS)
        plant.net.run(S)
        got, counts = plant.received(), plant.net.counts("/udp/9")
        assert got[1] and set(got[1]) == {sent}
        assert counts.dropped == {"interface_down": 200 - sum(map(len, got))}
        assert counts.delivered == sum(map(len, got)) < 200


def test_a_burst_is_read_in_parts_and_nothing_of_it_is_left():
    with Plant() as plant:
        burst = [to(1, 9, 9, bytes([number])) for number in range(65)]
        for sent in burst:
            try:
                plant.lines[0].programs.send(sent)
            except BlockingIOError:  # a small queue of this machine
                plant.gateway.take(plant.lines[0].tap, 0)
                plant.lines[0].programs.send(sent)
        plant.net.at(0, lambda: plant.gateway.take(plant.lines[0].tap, 0))
        plant.net.at(MS, lambda: plant.gateway.take(plant.lines[0].tap, MS))
        plant.net.run(S)
        assert sorted(plant.received()[1]) == sorted(burst)


def test_the_delays_of_hosts_differ_and_are_those_of_the_seed():
    def due_ns(seed):
        with Plant(seed=seed) as plant:
            for host in range(3):
                plant.send(host, to((host + 1) % 3, 9, 9, source=host))
            plant.net.run(S)
            return plant.due_ns

    assert due_ns(1) == due_ns(1) != due_ns(2)
    assert Counter(due_ns(1)).most_common(1)[0][1] == 1


def test_a_closed_tap_has_no_frames_and_takes_none():
    read, write = os.pipe()
    os.close(write)
    try:
        assert not HostTap(Address(0, 0), read).write(b"x")
    finally:
        os.close(read)
