"""Messages to several hosts by convoy: what happens is the same, for less."""

from unittest.mock import patch

import pytest
from graphs import MS, Net, S, listener, silent, talker
from hypothesis import example, given, settings
from hypothesis import strategies as st
from ros_networks import AT_ONCE, apart, stop

from desim.middleware.ros1.ros1 import Ros1
from desim.middleware.tcp.convoy import Convoy
from desim.network.carrier import Carrier
from netmodels.ideal import Ideal
from netmodels.rules.range import Range
from netmodels.switch import Switch

HEARERS = "bcde"
MODELS = {"switch": lambda: Switch(Switch.Params()),
          "slow": lambda: Switch(Switch.Params(rate="10 Mb/s")),
          "in order": lambda: Switch(Switch.Params(queue="pfifo")),
          "ideal": lambda: Ideal(Ideal.Params(delay="10 us")),
          "at once": lambda: Ideal(Ideal.Params(delay="0 ns"))}


def alone(convoy, size_bytes):
    """Stands in for ``Convoy.is_free``: each by itself."""
    return False


def outcome(model, says_ns, size_bytes, deeds, arp="natural"):
    """All rows, fates and counts of a talker's messages to four hosts."""
    heard = []
    nodes = {"a": talker([(S + at, str(at)) for at in says_ns], size_bytes=size_bytes, queue=3),
             **{name: listener(heard, queue=0) for name in HEARERS}, "m": silent}
    rules = [Range(Range.Params())]
    rules += [apart(host, start=f"{at} ns", until=f"{at + 500 * MS} ns")
              for deed, host, at in deeds if deed == "cut"]
    middleware = Ros1(Ros1.Params(master="m", tcp={"acks": "implied", "arp": arp}, **AT_ONCE))
    net = Net(nodes, MODELS[model](), rules, middleware=middleware)
    for deed, host, at in deeds:
        if deed == "stop":
            stop(net, host, at / S, at / S + 1)
        elif deed == "crowd":
            net.at(at, lambda: net.medium.transmit(0, (2,), 60_000, 40, False, Carrier(), None))
    net.run(6 * S)
    medium = net.medium
    return (sorted(net.rows()), sorted(net.fates), heard, medium.delivered, medium.dropped,
            medium.tx_bytes, medium.rx_bytes, medium.in_flight(), net.waiting())


AT_NS = st.integers(S, 3 * S)
DEEDS = st.lists(st.tuples(st.sampled_from(["cut", "stop", "crowd"]), st.sampled_from(HEARERS),
                           AT_NS), max_size=3)


@settings(max_examples=40)
@given(st.sampled_from(sorted(MODELS)),
       st.lists(st.integers(0, 2 * S), min_size=1, max_size=12).map(sorted),
       st.sampled_from([100, 1400, 20_000]), DEEDS, st.sampled_from(["natural", "static"]))
@example("switch", [0, 20_000, 100 * MS], 100, [("crowd", "c", 2 * S)], "static")
@example("switch", [S, S], 20_000, [("stop", "c", 2 * S + 20_000)], "static")
def test_a_convoy_is_many_messages_in_one(model, says_ns, size_bytes, deeds, arp):
    together = outcome(model, says_ns, size_bytes, deeds, arp)
    with patch.object(Convoy, "is_free", alone):
        assert outcome(model, says_ns, size_bytes, deeds, arp) == together


TICKS = [100 * MS * k for k in range(10)]


@pytest.mark.parametrize("model", ["switch", "in order", "ideal"])
def test_a_fleet_s_poses_go_by_convoy(model):
    with patch.object(Convoy, "send", autospec=True, side_effect=Convoy.send) as sent:
        outcome(model, TICKS, 100, [])
    assert sent.call_count >= len(TICKS) - 1  # the first may find addresses unknown


def test_a_convoy_that_is_a_nanosecond_late_shows():
    """A twin: the comparison above sees it."""
    def late(convoy, flights, delays_ns):
        expected_many(convoy, flights, [delay_ns + 1 for delay_ns in delays_ns])

    expected_many = Convoy.expected_many
    right = outcome("switch", TICKS, 100, [])
    with patch.object(Convoy, "expected_many", late):
        assert outcome("switch", TICKS, 100, []) != right
