"""Small networks whose messages go in batches: they are the same message by message."""

from contextlib import contextmanager
from functools import partial
from typing import NamedTuple

import pytest
from graphs import MS, Net, S, Words
from hypothesis import given, settings
from hypothesis import strategies as st

from desim.engine.kernel import Phase
from desim.middleware.batches.batch import Batch, Member
from desim.middleware.batches.publisher import BatchPublisher
from desim.middleware.batches.way import BatchWay
from desim.middleware.direct import Direct
from desim.middleware.topics import Topic, WaitSet
from desim.ports import PASS, Deliver, Drop
from netmodels.ideal import Ideal
from netmodels.switch import Switch

HOSTS = "abcdm"


class Talker(NamedTuple):
    """Says words of a size on a topic of its own; ``ears``: how hosts listen to it."""

    host: str
    hz: int
    size_bytes: int
    ears: dict[str, str]
    start: str = "zero"
    latch: bool = False


class Story(NamedTuple):
    """All that happens; times are ms."""

    talkers: list[Talker]
    sensors: list[tuple[int, str]] = []  # topics that m publishes in one instant, and subscribers
    faults: list[tuple[int, str, int]] = []  # when a host stops, and for how long
    cuts: list[tuple[int, int, str]] = []  # from when to when a rule loses a host's frames


class Cuts:
    """A rule that loses all frames to and from a host for a while, and can tell when it does."""

    reasons = ("cut",)

    def __init__(self, cuts):
        self._cuts = [(begin * MS, end * MS, HOSTS.index(host)) for begin, end, host in cuts]

    def start(self, context, hosts):
        self._context = context

    def _lost(self, source, receiver):
        now_ns = self._context.now_ns
        return any(begin <= now_ns < end and host in (source, receiver)
                   for begin, end, host in self._cuts)

    def judge(self, frame, receivers):
        return [Drop("cut") if self._lost(frame.source, receiver) else PASS
                for receiver in receivers]

    def all_pass(self, frames):
        return not any(self._lost(frames.source, receiver) for receiver in frames.receivers)


class Moody(Ideal):
    """Of ten frames it loses one at once; another it settles later, another much later."""

    reasons = ("moody",)

    def start(self, context, hosts):
        super().start(context, hosts)
        self._context = context

    def send(self, frame):
        if frame.broadcast or frame.id < 150 or (mood := frame.id * 7 % 10) > 2:
            return super().send(frame)
        verdict = Drop("moody") if mood == 0 else Deliver(1000)
        if mood == 0 and frame.id % 20 < 10:
            self._context.settle(frame, frame.receivers[0], verdict)
        else:
            self._context.at(self._context.now_ns + (250 * MS if mood == 2 else 50_000),
                             lambda _: self._context.settle(frame, frame.receivers[0], verdict))
        return None


class Stalls(Ideal):
    """Frames of the third second take a quarter of a second more, which nobody foresees."""

    def start(self, context, hosts):
        super().start(context, hosts)
        self._context = context

    def send(self, frame):
        if frame.broadcast or not 2 * S <= self._context.now_ns < 3 * S:
            return super().send(frame)
        self._context.at(self._context.now_ns + 250 * MS, lambda _: self._context.settle(
            frame, frame.receivers[0], Deliver(1000)))
        return None


def ideal(delay, cls=Ideal):
    return lambda: cls(cls.Params(delay=delay))


def switch(**params):
    return lambda: Switch(Switch.Params(**params))


MODELS = {"no delay": ideal("0 s"), "near": ideal("20 us"), "far": ideal("3 ms"),
          "very far": ideal("120 ms"), "late": ideal("230 ms"), "moody": ideal("20 us", Moody),
          "stalls": ideal("20 us", Stalls),
          "switch": switch(), "nodes": switch(ports={"x": ["a", "b"], "y": ["c", "m"]}),
          "slow": switch(rate="3 Mb/s", queue="pfifo", ports={"x": ["a", "b"]}),
          "full": switch(rate="3 Mb/s", queue="fq_codel", buffer="6 kB")}


class Costs:
    """Callbacks take 2 ms, and each message 0.1 ms."""

    def callback_ns(self, work):
        return 2 * MS

    def send_ns(self, topic, size_bytes, links):
        return links * 100_000

    def receive_ns(self, topic, size_bytes):
        return 100_000


def software(story, host, heard):
    """Starts the node of ``host``."""
    def note(node, message):
        heard.append((node.now_ns, host, message.topic, message.content.text))

    def begin(node):
        waiting, kept = WaitSet(), []
        for number, talker in enumerate(story.talkers):
            topic, kind = f"/{talker.host}/{number}", talker.ears.get(host)
            if talker.host == host:
                node.advertise(topic, latch=talker.latch, queue=2)
                node.timer(talker.hz, lambda k, topic=topic, talker=talker: node.publish(
                    topic, Words(f"{topic} {k}", talker.size_bytes)), talker.start)
            if kind in ("callback", "both"):
                node.subscribe(topic, partial(note, node), queue=3)
            if kind == "later":
                kept.append(node.latest(topic))
                node.timer(1, lambda k, topic=topic: k == 1 and node.subscribe(
                    topic, partial(note, node)))
            if kind in ("latest", "both"):
                kept.append(node.latest(topic))
            elif kind == "waits":
                node.latest(topic, waiting)
        for number, (_, subscriber) in enumerate(story.sensors):
            if subscriber == host:
                node.latest(f"/sensor/{number}", waiting)
        node.timer(10, lambda k: [note(node, message) for _, message in waiting.news()], "zero")
        node.timer(7, lambda k: [note(node, latest.read()) for latest in kept
                                 if latest.read() is not None])
        if host == "m" and story.sensors:
            publishers = BatchPublisher([node.advertise(f"/sensor/{number}")
                                         for number in range(len(story.sensors))], 700)
            node.timer(story.sensors[0][0], lambda k: publishers.publish(
                lambda i: Words(f"sensor {i} {k}", 700)), "zero")
    return begin


def played(story, model="near", busy=False, until_ns=4 * S):
    """All that can be seen of it."""
    heard, samples = [], []
    net = Net({host: software(story, host, heard) for host in HOSTS}, MODELS[model](),
              [Cuts(story.cuts)] if story.cuts else [], middleware=Direct(),
              costs=Costs() if busy else None)
    graph, medium = net.graph, net.medium

    def sample(_):
        graph.catch_up()
        samples.append([(name, topic.counts.in_flight, topic.counts.delivered, sum(
            publisher.waiting() for publisher in topic.publishers))
            for name, topic in sorted(graph.topics.items())])
        samples.append((medium.delivered, medium.in_flight()))

    net.kernel.ticker(9, Phase.OBSERVE, net.names.id("onlooker"), sample)
    for time_ms, name, for_ms in story.faults:
        host = graph.host(name)
        net.at(time_ms * MS, host.stop)
        net.at((time_ms + for_ms) * MS, host.start)
    net.run(until_ns)
    graph.book_expected()  # links hear of all that batches have done
    return {
        "heard": heard, "rows": sorted(net.rows()), "fates": sorted(net.fates), "samples": samples,
        "medium": (medium.frames, medium.intended, medium.delivered, medium.packets_delivered,
                   medium.dropped, list(medium.tx_bytes), list(medium.rx_bytes)),
        "topics": [(name, topic.counts.bytes, topic.counts.intended, topic.counts.unmatched,
                    topic.counts.dropped, topic.counts.queued, topic.counts.called,
                    topic.counts.latencies.tolist())
                   for name, topic in sorted(graph.topics.items())],
        "arrivals": [host.last_arrival_ns.tolist() for host in graph.hosts],
        "links": [(topic.name, receiver, link._trip_ns, link._tries, link.waiting)
                  for _, topic in sorted(graph.topics.items()) for publisher in topic.publishers
                  for receiver, link in sorted(publisher.transport.links().items())]}


def listens_by_callback(topic, host, latest, subscriptions, listens=Topic.listens):
    """``Topic.listens`` of a topic that knows of no host without a callback."""
    listens(topic, host, latest, subscriptions)
    topic.latest.clear()


@contextmanager
def singly():
    """Each message for itself, and an event for each arrival."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(BatchPublisher, "_members", lambda batches: [])
        patch.setattr(Topic, "listens", listens_by_callback)
        yield


def the_same(*args, **options):
    """All that can be seen of a story, which is the same message by message."""
    in_batches = played(*args, **options)
    with singly():
        one_by_one = played(*args, **options)
    for what, seen in one_by_one.items():
        assert in_batches[what] == seen, what
    return in_batches


TIMES_MS = st.one_of(st.integers(0, 40).map(lambda k: 100 * k), st.integers(0, 4000))
HOST = st.sampled_from(HOSTS)
KINDS = ["waits", "waits", "latest", "callback", "both", "later"]
STORIES = st.builds(
    Story,
    st.lists(st.builds(
        Talker, HOST, st.sampled_from([2, 10, 10, 20, 100]),
        st.sampled_from([80, 80, 1400, 3000, 9000]),
        st.dictionaries(HOST, st.sampled_from(KINDS), min_size=2),
        st.sampled_from(["zero", "random"]), st.sampled_from([False, False, False, True])),
             min_size=1, max_size=5),
    st.lists(st.tuples(st.sampled_from([10, 25]), HOST), max_size=4),
    st.lists(st.tuples(TIMES_MS, HOST, st.integers(1, 900)), max_size=2,
             unique_by=lambda fault: fault[1]),
    st.lists(st.tuples(TIMES_MS, TIMES_MS, HOST), max_size=1))


@settings(max_examples=40)
@given(STORIES, st.sampled_from([*MODELS]), st.booleans())
def test_whatever_happens_it_is_the_same_message_by_message(story, model, busy):
    the_same(story, model, busy)


def everybody(kind="waits", hz=10, size_bytes=80, start="random"):
    """Each host says something to all others."""
    return [Talker(host, hz, size_bytes, {other: kind for other in HOSTS if other != host}, start)
            for host in HOSTS]


def test_what_goes_to_everybody_goes_in_batches():
    """All of it, once everybody is connected."""
    batches = [0, 0]
    with pytest.MonkeyPatch.context() as patch:
        publish = BatchPublisher._publish

        def counted(self, content):
            sent = publish(self, content)
            if self.kernel.now_ns > 2 * S:
                batches[sent] += 1
            return sent

        patch.setattr(BatchPublisher, "_publish", counted)
        played(Story(everybody()), "nodes")
    assert batches == [0, 5 * 20]


CUT_AND_STOP = Story(everybody() + everybody("both", 2, 1400, "zero"), [(25, "a"), (25, "b")],
                     [(1800, "c", 300)], [(2500, 2800, "b")])
TOGETHER = Story(everybody(start="zero"))
SELDOM = Story(everybody(hz=2))
SEVERAL = Story(everybody(hz=2, size_bytes=1400) + everybody(hz=1, size_bytes=9000, start="zero"))


@pytest.mark.parametrize("part, name, broken, story, model, what", [
    (BatchWay, "_note_trips", lambda way, least_ns: None, SEVERAL, "slow", "links"),
    (Member, "give", lambda member, batch: None, CUT_AND_STOP, "very far", "fates"),
    (BatchPublisher, "waiting", lambda batches, publisher: 0, SELDOM, "very far", "samples"),
    (Member, "hand_over", lambda member, batch: None, CUT_AND_STOP, "near", "heard"),
    (Member, "newer", lambda member, known: None, TOGETHER, "near", "heard"),
    (Batch, "over_ns", lambda batch, kernel: kernel.last_over_ns(Phase.DELIVER), TOGETHER,
     "nodes", "heard"),
])
def test_broken_batches_are_found(part, name, broken, story, model, what):
    sound = played(story, model)[what]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(part, name, broken)
        assert played(story, model)[what] != sound


@pytest.mark.parametrize("model", ["near", "no delay", "moody"])
def test_cuts_and_stops_are_the_same_message_by_message(model):
    the_same(CUT_AND_STOP, model)


def test_what_arrives_without_delay_is_read_in_the_next_round():
    the_same(TOGETHER, "nodes")
