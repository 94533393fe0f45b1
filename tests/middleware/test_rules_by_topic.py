"""Rules that act on some topics only, under each middleware and transport.

What they do to the frames of one topic leaves each message of the others its fate.
"""

from functools import partial

import pytest
from configured import configured
from ddsnets import dds
from graphs import MS, Net, S, listener, silent, talker
from ros_networks import AT_ONCE
from zenoh_networks import zenoh

from desim import plugins
from desim.middleware.direct import Direct
from desim.middleware.message_ledger import MessageLedger
from desim.middleware.multimaster.multimaster import Multimaster
from desim.middleware.ros1.ros1 import Ros1
from desim.middleware.udp.cut_train import CutTrain
from desim.network.passages import Passages
from desim.network.scoped_rule import Scoped, scoped
from desim.testing.capabilities import Retrying
from desim.testing.medium_bench import Bench
from netmodels.ideal import Ideal

FIRST_NS, EVERY_NS = 20 * S, 500 * MS  # all have found each other by then
LARGE_BYTES = 20_000  # several packets: trains, and fragments that are put together


def ros1(**params):
    return Ros1(configured(Ros1.Params, **{"master": "m", **AT_ONCE, **params}))


MIDDLEWARES = {
    "direct": Direct, "ros1": ros1,
    "rospy": partial(ros1, client="rospy"),
    "multimaster": lambda: Multimaster(configured(Multimaster.Params, preset="fkie_1_3")),
    "cyclonedds": dds, "fastdds": partial(dds, "fastdds"), "zenoh": zenoh}
BROADCAST = {"transport": "datagram", "via": "broadcast"}
TRANSPORTS = {"stream": {"transport": "stream"}, "datagram": {"transport": "datagram"},
              "broadcast": BROADCAST}
CASES = [(middleware, transport) for middleware in MIDDLEWARES for transport in TRANSPORTS
         if transport != "broadcast" or middleware == "direct" or "dds" in middleware]


def lossy(probability, *topics, rule="loss"):
    """A rule that acts on ``topics`` only."""
    params = plugins.parameters("rule", rule)(probability=probability, topics=list(topics))
    return scoped(plugins.load("rule", rule)(params), params)


def played(middleware, transport, *rules, model=None, size_bytes=100, scans_to=("b", "c"),
           **options):
    """The network after a has sent ten messages on /scan and on /map, and what was heard of each.
    """
    scans, maps = [], []
    says = [(FIRST_NS + number * EVERY_NS, str(number)) for number in range(10)]
    own = TRANSPORTS[transport]
    mapped = ("b", "c") if "c" in scans_to else ("c",)
    nodes = {"a": {"scanner": talker(says, "/scan", size_bytes, **own),
                   "mapper": talker(says, "/map", size_bytes, **own)}, "m": silent}
    for host in ("b", "c"):
        nodes[host] = {"scans": listener(scans, "/scan") if host in scans_to else silent,
                       "maps": listener(maps, "/map") if host in mapped else silent}
    net = Net(nodes, model or Ideal(Ideal.Params(delay="10 ms")), rules,
              middleware=MIDDLEWARES[middleware](), **options)
    return net.run(FIRST_NS + 10 * S), scans, maps


def heard(*args, **options):
    """The messages that were heard on /scan and on /map."""
    return played(*args, **options)[1:]


def unlike(middleware, transport, **options):
    """The topics whose messages fare otherwise with half of the frames of /scan lost."""
    if "zenoh" in middleware:  # it has one link to each host for all topics
        options["scans_to"] = ("b",)
    plain = heard(middleware, transport, **options)
    assert all(plain)
    found = heard(middleware, transport, lossy(0.5, "/sc?n", "/nothing"), **options)
    return [topic for topic, before, after in zip(("/scan", "/map"), plain, found, strict=True)
            if before != after]


@pytest.mark.parametrize("size_bytes", [100, LARGE_BYTES])
@pytest.mark.parametrize(("middleware", "transport"), CASES)
def test_losses_of_one_topic_leave_the_other_as_it_was(middleware, transport, size_bytes):
    assert unlike(middleware, transport, size_bytes=size_bytes) == ["/scan"]


@pytest.mark.parametrize(("middleware", "transport"), CASES)
def test_a_mac_that_repeats_asks_for_each_transmission(middleware, transport):
    """So do messages that go in batches."""
    assert unlike(middleware, transport, model=Retrying()) == ["/scan"]


@pytest.mark.parametrize(("middleware", "transport"), [
    ("direct", "stream"), ("ros1", "stream"), ("fastdds", "datagram"), ("zenoh", "stream")])
def test_the_twin_a_gate_that_asks_for_no_topics(middleware, transport, monkeypatch):
    monkeypatch.setattr(Scoped, "follow", lambda self, topics: setattr(self, "_follows", True))
    assert "/map" in unlike(middleware, transport)


@pytest.mark.parametrize("model", [None, Retrying()])
@pytest.mark.parametrize(("middleware", "transport"), CASES)
def test_control_frames_carry_no_topic(middleware, transport, model):
    """All find each other, and no message arrives, however often it is sent."""
    net, *nothing = played(middleware, transport, lossy(1.0, "/*"), model=model)
    assert nothing == [[], []]
    assert net.counts("/scan").intended == net.counts("/map").intended == 20


def test_a_ledger_changes_nothing():
    plain = heard("direct", "stream", lossy(0.5, "/scan"))
    assert heard("direct", "stream", lossy(0.5, "/scan"), ledger=MessageLedger(Passages())) == plain


def test_a_host_that_forwards():
    def routes(graph, media):
        graph.routes.forward("m", [media["lan"], media["air"]])

    def lost(*rules):
        return heard("direct", "stream", on=["a", "m"], routes=routes, further={
            "air": (Ideal(Ideal.Params()), rules, ["b", "c", "m"])})

    (scans, maps), (lost_scans, same_maps) = lost(), lost(lossy(0.5, "/scan"))
    assert maps == same_maps
    assert scans != lost_scans


def test_a_train_that_goes_out_in_parts_has_its_topics():
    bench = Bench(Ideal(Ideal.Params()))
    part = CutTrain(bench, ("label", "host_1"), (1,), 4, 2)
    assert part.topics(range(2)) == bench.topics(("label", "host_1")) == ("/host_1/frames",)


def test_a_train_with_messages_of_several_topics_follows_each():
    """Over the one link of Zenoh what is lost of one topic holds up the other."""
    def both(*topics):
        return heard("zenoh", "stream", *([lossy(1.0, *topics)] if topics else []))

    assert both("/scan")[1] != both()[1] == both("/nothing")[1]
