"""Repeated samples of DDS: how often they are asked for and sent, and that this comes to an end."""

import numpy as np
import pytest
from ddsnets import Nth, dds, partition
from graphs import MS, Net, S, listener, talker

from desim.commands.views.message_rows import story
from desim.middleware.dds import wire
from desim.middleware.direct import Direct
from desim.ports import Drop
from desim.scenario.schema.sockets import Sockets
from netmodels.access_link import AccessLink


class Unheard:
    """Drops what a says apart from data from 3 s on, and what b says until 4 s."""

    reasons = ("unheard",)

    def start(self, context, hosts):
        self._context = context

    def judge(self, frame, receivers):
        now_ns = self._context.now_ns
        if now_ns < 3 * S or frame.size_bytes != wire.CYCLONEDDS.heartbeats(1).size_bytes or (
                frame.source == 1 and now_ns > 4 * S):
            return None
        return [Drop("unheard") for _ in receivers]


@pytest.mark.parametrize("renewal", ["3 s", "2 s"])
def test_a_reader_whose_request_gets_lost_asks_again_without_being_asked(renewal):
    """The second of three, the request for it and all heartbeats of the writer get lost."""
    heard = []
    says = [(2 * S, "one"), (3 * S, "two"), (3040 * MS, "three")]
    net = Net({"a": talker(says, queue=10), "b": listener(heard, queue=0)},
              middleware=dds(nack_delay="20 ms", nack_renewal=renewal), rules=[
                  Nth([2], [238]), Unheard()]).run(8 * S)
    asked = [row[0] for row in net.rows("acknack") if row[5]]
    assert asked == [3060 * MS, 3060 * MS + int(renewal[0]) * S]
    assert [text for *_, text in heard] == ["one", "two", "three"]


@pytest.mark.parametrize(("lost", "asked"), [(255, [255]), (256, [256]), (257, [256, 1])])
def test_one_request_names_256_samples_at_most(lost, asked):
    """The bitmap of an ACKNACK has 256 bits (RTPS 2.3, 9.4.2.6, SequenceNumberSet)."""
    heard = []
    says = [(2 * S, "first"), *((3 * S + k * MS, "lost") for k in range(lost)), (4 * S, "last")]
    net = Net({"a": talker(says, queue=0), "b": listener(heard, queue=0)},
              middleware=dds(), rules=[partition("2.9 s", "3.9 s")]).run(10 * S)
    assert [row[5] for row in net.rows("acknack") if row[5]] == asked
    assert len(heard) == lost + 2


@pytest.mark.parametrize(("ack_again", "between_ns"), [("10 ms", 12 * MS), ("0 ns", 4 * MS)])
def test_the_same_acknowledgement_is_not_said_twice_within_10_ms(ack_again, between_ns):
    """Heartbeats are 4 ms apart until the first answer is there, 60 ms after the sample."""
    net = Net({"a": talker([(2 * S, "one")]), "b": listener([])},
              AccessLink(AccessLink.Params(latency="30 ms")), middleware=dds(
                  heartbeat_period="4 ms", heartbeat_limit="4 ms", ack_again=ack_again))
    times = [row[0] for row in net.run(5 * S).rows("acknack") if row[0] > 2 * S]
    least_ns = min(late - early for early, late in zip(times, times[1:], strict=False))
    assert least_ns == pytest.approx(between_ns, abs=20_000), "but for the frames' own lengths"


@pytest.mark.parametrize(("middleware", "words"), [
    (dds(), "partitioned; its reader asks for it after the next heartbeat"),
    (Direct(), "partitioned; sent again at its retransmission timeout, or when TCP finds out "
     "sooner")])
def test_the_story_of_a_lost_message_says_who_will_notice(middleware, words):
    net = Net({"a": talker([(2 * S, "one"), (3 * S, "two")]), "b": listener([])},
              middleware=middleware, rules=[partition("3 s", "3.01 s")]).run(10 * S)
    net.trace.flush()
    steps = story(np.concatenate(net.batches), net.names.items(), 2)
    assert [step.detail for step in steps if step.what == "lost"] == [words]
    assert [step.what for step in steps].count("frame") == 2


def test_of_a_large_sample_the_lost_train_alone_is_sent_again():
    """640 kB in 48 datagrams of cyclonedds, four in a train; the third train is lost, and its
    forty fragments are sent one by one, the last one with a heartbeat."""
    heard = []
    net = Net({"a": talker([(2 * S, "map")], size_bytes=640_000), "b": listener(heard)},
              middleware=dds(), rules=[Nth([3], range(50_000, 60_000))]).run(5 * S)
    frames = [row[5] for row in net.rows("frame")]
    fragment = 46 + 20 + 16 + 36 + 1344
    assert len(frames) == 12 + 40 and frames[12:] == [fragment] * 39 + [fragment + 32]
    assert heard == [(2 * S, "b", "a", "map")]


class Second:
    """Drops the second large frame of those from 6 s on."""

    reasons = ("unlucky",)

    def start(self, context, hosts):
        self._context, self._count = context, 0

    def judge(self, frame, receivers):
        self._count += frame.size_bytes > 50_000 and self._context.now_ns >= 6 * S
        return [Drop("unlucky")] if self._count == 2 else None


@pytest.mark.parametrize(("rate", "latency", "trains"), [
    ("1 Gb/s", "1 ms", [12, 2, 2, 12]), ("1 Gb/s", "50 ms", [12] * 4),
    ("50 Mb/s", "1 ms", [12] * 4)])
def test_trains_are_long_where_samples_arrive_soon_until_one_is_lost(rate, latency, trains):
    """Large frames of four samples; of the third one, the second frame is lost."""
    heard = []
    says = [(2 * k * S, str(k)) for k in range(1, 5)]
    net = Net({"a": talker(says, queue=10, size_bytes=640_000), "b": listener(heard, queue=0)},
              AccessLink(AccessLink.Params(rate=rate, latency=latency)), rules=[Second()],
              middleware=dds(initial_acknack=None), sockets=Sockets(send_buffer="4 MB")).run(12 * S)
    large = [row[4] for row in net.rows("frame") if row[5] > 50_000]
    assert [large.count(number) for number in (1, 2, 3, 4)] == trains
    assert [text for *_, text in heard] == ["1", "2", "3", "4"]


def crowded(until_s, **params):
    """Three hosts say 3 MB to each other within 7.5 s, over 250 kb/s with a queue of 8 s; their
    sockets and histories take it all."""
    heard = []
    says = [(2 * S + k * 150 * MS, str(k)) for k in range(50)]
    nodes = {host: {"t": talker(says, f"/{host}", queue=0, size_bytes=20_000),
                    "l": lambda node: [listener(heard, f"/{other}", queue=0)(node)
                                       for other in "abc" if other != node.host.name]}
             for host in "abc"}
    link = AccessLink(AccessLink.Params(rate="250 kb/s", latency="5 ms", queue="256 kB"))
    net = Net(nodes, link, middleware=dds(lease="1 h", high=None, **params),
              sockets=Sockets(send_buffer="1 GB")).run(until_s * S)
    return net, len(heard)


def test_after_congestion_everything_arrives_and_then_there_is_silence():
    """Reports and acknowledgements of liveliness are all that is said in the last 100 s."""
    net, heard = crowded(200)
    frames = net.medium.frames
    assert heard == 300 and net.waiting() == 0 and frames < 60_000
    assert net.run(300 * S).medium.frames - frames < 400


def test_of_what_is_repeated_without_a_pause_most_is_there_already():
    """So that the network carries the same things again and again, three times as much for less."""
    net, heard = crowded(50, nack_suppression="0 ns")
    calm, announced = crowded(50)
    assert heard < announced and net.medium.frames > 3 * calm.medium.frames
