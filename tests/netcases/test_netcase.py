"""Network cases without robots: how they are played and measured, and that ours keep the contract.
"""

import pytest

from desim.errors import InputError
from desim.netcases.case import play
from desim.ports import Params
from desim.ports.cases import NOWHERE, Flow, Setup
from desim.testing import check_case
from netmodels.access_link import AccessLink
from netmodels.cases.broadcast import HeartbeatBroadcast, sunflower
from netmodels.cases.load import Bottleneck, SharedBus
from netmodels.cases.saturation import Saturation
from netmodels.cases.two_senders import Hidden, TwoPairs
from netmodels.ideal import Ideal
from netmodels.radio.dcf.radio import DcfRadio

MS, S = 10**6, 10**9

CASES = [
    (Saturation, {"stations": 3, "duration": "50 ms"}),
    (Saturation, {"standard": "11b", "topology": "pairs", "stations": 2, "duration": "50 ms"}),
    (HeartbeatBroadcast, {"stations": 3, "duration": "1 s"}),
    (HeartbeatBroadcast, {"stations": 3, "duration": "1 s", "arrivals": "zero", "radius": "60 m"}),
    (TwoPairs, {"duration": "50 ms"}),
    (Hidden, {"duration": "50 ms", "rts": True}), (Hidden, {"duration": "1 s", "load": "1 Mb/s"}),
    (Bottleneck, {"duration": "1 s"}), (Bottleneck, {"duration": "1 s", "arrivals": "periodic"}),
    *((SharedBus, {"duration": "1 s", "mode": mode}) for mode in ("csma", "csma_cd", "fifo")),
]


@pytest.mark.parametrize(("cls", "params"), CASES)
def test_cases_keep_their_contract(cls, params):
    check_case(cls, **params)


def case_of(setup):
    class Case:
        Params = Params

        def __init__(self, params):
            pass

        def setup(self):
            return setup()

    return Case


@pytest.mark.parametrize(("wrong", "advice"), [
    ({"places": {"a": NOWHERE}}, "give a place to b"),
    ({"warm_up_ns": 2 * S}, "measure after the warm-up, not -1000000000 ns"),
    ({"flows": [Flow("a", ("a",), 1, 1)]}, "not let a send to itself"),
    ({"flows": []}, "last so long that frames are settled"),
])
def test_the_kit_finds_cases_that_do_not(wrong, advice):
    def setup():
        return link_setup(Flow("a", ("b",), 125, 100, "periodic", 10 * MS))._replace(**wrong)

    with pytest.raises(AssertionError, match=f"must {advice}"):
        check_case(case_of(setup))


# ------------------------------------------------------------------------------ what is measured


def link_setup(*flows, duration_ns=S, **params):
    """1 ms for 125 B."""
    link = AccessLink(AccessLink.Params(rate="1 Mb/s", **params))
    return Setup(link, {"a": NOWHERE, "b": NOWHERE}, flows, duration_ns)


def test_all_measures_of_an_idle_line():
    """A hundred frames a second, each of 125 B with 100 B of payload, from a phase below 9 ms."""
    found = play(link_setup(Flow("a", ("b",), 125, 100, "periodic", 10 * MS)), seed=2)
    assert found == {
        "goodput_mbps": pytest.approx(0.08), "throughput_mbps": pytest.approx(0.1),
        "offered_mbps": pytest.approx(0.08), "fairness": 1.0, "frames": 100, "delivered": 100,
        "lost": {}, "delivery_ratio": 1.0, "loss": 0.0, "drop_rate": 0.0, "attempts": None,
        "failure_rate": None, "delay_mean_ms": 1.0, "delay_error_ms": None, "delay_p50_ms": 1.0,
        "delay_p95_ms": 1.0, "delay_p99_ms": 1.0, "control_frames": None, "control_bytes": None,
        "utilisation": {"mean": pytest.approx(0.05), "max": pytest.approx(0.1)},
        "goodput_share": None, "measured_s": 1.0, "delay_mean_ms_by_mark": {"0": 1.0},
        "delay_p95_ms_by_mark": {"0": 1.0}, "goodput_mbps_by_mark": {"0": pytest.approx(0.08)}}


def test_a_flow_may_begin_later_and_a_setup_be_compared_with_another_one():
    """Half of what the other one carries; the last frame is sent at the end."""
    late = Flow("a", ("b",), 125, 100, "zero", 10 * MS, begin_ns=500 * MS)
    whole = link_setup(late._replace(begin_ns=0))
    found = play(link_setup(late)._replace(compared=whole))
    assert (found["frames"], found["goodput_share"]) == (51, 0.5)


def test_those_who_begin_at_zero_queue_in_the_order_of_flows():
    found = play(link_setup(*(Flow("a", ("b",), 125, 100, "zero", 100 * MS) for _ in range(3)),
                            duration_ns=99 * MS))
    assert (found["frames"], found["delay_mean_ms"], found["delay_p50_ms"]) == (3, 2.0, 2.0)


def test_the_warm_up_is_not_counted():
    """Of 20 frames, every 50 ms from 0, those of the first half; what arrives counts where it
    arrives."""
    setup = link_setup(Flow("a", ("b",), 125, 100, "zero", 50 * MS), latency="10 ms")
    found = play(setup._replace(warm_up_ns=500 * MS))
    # That of 500 ms was sent in the first half, that of 1000 ms is on its way.
    assert (found["frames"], found["delivered"], found["measured_s"]) == (10, 10, 0.5)


def test_what_a_full_queue_drops_was_not_given_up():
    """5 frames at once, one is sent, two wait."""
    flows = [Flow("a", ("b",), 125, 100, "zero", 100 * MS)] * 5
    found = play(link_setup(*flows, queue_packets=2, duration_ns=99 * MS))
    assert (found["delivered"], found["lost"], found["loss"], found["drop_rate"]) == (
        3, {"queue_full": 2}, 0.4, 0.0)
    assert found["fairness"] == pytest.approx(3 / 5)


def test_a_backlog_is_there_at_once():
    found = play(link_setup(Flow("a", ("b",), 125, 100, "zero", 10 * S, backlog=4)))
    assert (found["frames"], found["delivered"], found["delay_mean_ms"]) == (5, 5, 3.0)


def test_a_train_is_counted_in_packets():
    """Two trains of four packets, 1 ms each; all of one have the delay of the last."""
    found = play(link_setup(Flow("a", ("b",), 125, 100, "zero", 10 * S, train=4, backlog=1)))
    assert (found["frames"], found["delivered"], found["delay_mean_ms"]) == (8, 8, 6.0)
    assert found["goodput_mbps"] == pytest.approx(8 * 8e-4)
    lossy = play(link_setup(Flow("a", ("b",), 125, 100, "zero", 10 * S, train=8), queue_packets=2))
    assert (lossy["delivered"], lossy["lost"]) == (3, {"queue_full": 5})


@pytest.mark.parametrize(("flow", "message"), [
    (Flow("a", ("b",), 1000, 900, train=2),
     "a would send trains of 2 packets of 1000 B, which are cut into packets of 1518 and 482 B; "
     "allowed: as many or as long ones as are cut into equal packets"),
    (Flow("a", ("b",), 125, 100, "zero", S, broadcast=True, train=4),
     "a would send trains of 4 packets; allowed: of unicast packets of UDP that go one way, "
     "without via")])
def test_trains_that_cannot_be(flow, message):
    with pytest.raises(InputError) as caught:
        play(link_setup(flow))
    assert str(caught.value) == message


def test_an_echo_takes_the_way_twice():
    found = play(link_setup(Flow("a", ("b",), 125, 100, "zero", 100 * MS, echo=True)))
    assert (found["delivered"], found["delay_mean_ms"]) == (10, 2.0)


def test_saturated_means_never_idle():
    found = play(link_setup(Flow("a", ("b",), 125, 100)))
    assert (found["delivered"], found["delay_mean_ms"], found["offered_mbps"]) == (
        1000, pytest.approx(2.0, rel=0.001), None)


def test_a_saturated_flow_that_is_refused_does_not_insist():
    found = play(link_setup(Flow("a", ("b",), 125, 100), queue_packets=0))
    assert (found["delivered"], found["lost"]) == (1000, {"queue_full": 1})


def test_poisson_arrivals():
    setup = Setup(Ideal(Ideal.Params()), {"a": NOWHERE, "b": NOWHERE},
                  [Flow("a", ("b",), 125, 100, "poisson", MS)], 20 * S)
    assert abs(play(setup)["frames"] / 20_000 - 1) < 4 / 20_000 ** 0.5
    assert play(setup)["frames"] != play(setup, seed=2)["frames"]


def test_another_flow_moves_no_arrival():
    one = Flow("a", ("b",), 125, 100, "poisson", MS)
    few, many = (play(Setup(Ideal(Ideal.Params()), {"a": NOWHERE, "b": NOWHERE, "c": NOWHERE},
                            flows, S))["frames"]
                 for flows in ([one], [one, one._replace(source="c", every_ns=10 * S)]))
    assert few <= many <= few + 2


def test_nothing_sent_has_no_shares():
    found = play(link_setup(Flow("a", ("b",), 125, 100, "periodic", 10**18)))
    assert (found["delivery_ratio"], found["loss"], found["drop_rate"], found["fairness"],
            found["delay_mean_ms"], found["delay_p99_ms"]) == (None,) * 6


def test_a_broadcast_counts_at_each_receiver():
    """b hears it, c is too far away; a broadcast is not given up."""
    setup = Setup(DcfRadio(DcfRadio.Params(standard="11a", broadcast_rate="6 Mb/s")),
                  {"a": (0.0, 0.0), "b": (10.0, 0.0), "c": (190.0, 0.0)},
                  [Flow("a", ("b", "c"), 246, 200, "zero", 100 * MS, broadcast=True)], 999 * MS)
    found = play(setup)
    assert (found["frames"], found["delivered"], found["lost"], found["drop_rate"]) == (
        10, 10, {"out_of_reach": 10}, None)
    assert found["offered_mbps"] == pytest.approx(2 * found["goodput_mbps"])


def test_no_packet_is_longer_than_80211_has_frames_for():
    def played(size_bytes):
        return play(Setup(DcfRadio(DcfRadio.Params(standard="11b", rate="1 Mb/s")),
                          {"a": (0.0, 0.0), "b": (1.0, 0.0)},
                          [Flow("a", ("b",), size_bytes, size_bytes)], S))

    assert played(2314)["delivered"] > 0
    with pytest.raises(InputError, match="2315 B is too long for 802.11; at most 2314 B"):
        played(2315)


# --------------------------------------------------------------------------------- our own cases


@pytest.mark.parametrize("load", [1.0001, 1.05, 3])
def test_an_overloaded_queue_is_full_from_the_beginning(load):
    """Of 100 packets that wait a new one waits for all but the part that has gone meanwhile."""
    found = play(Bottleneck(Bottleneck.Params(senders=7, load=load, arrivals="periodic",
                                              latency="0 s", duration="2 s")).setup())
    assert 99 * 1.2016 < found["delay_mean_ms"] < 101 * 1.2016
    assert found["loss"] == pytest.approx(1 - 1 / load, abs=0.001)


def test_attempts_failures_and_drops_of_two_who_cannot_hear_each_other():
    found = play(Hidden(Hidden.Params(spacing="40 m", duration="2 s")).setup())
    assert found["attempts"] > found["delivered"] > 0
    assert 0.6 < found["failure_rate"] < 0.9
    assert found["drop_rate"] == pytest.approx(
        found["lost"]["retry_limit"] / (found["lost"]["retry_limit"] + found["delivered"]))


def test_the_standards_highest_rate_is_the_default():
    for standard, most_mbps in ("11a", 54), ("11b", 11), ("11g", 54):
        given, default = (play(Saturation(Saturation.Params(
            standard=standard, stations=1, duration="200 ms", **rate)).setup())
            for rate in ({}, {"rate": f"{most_mbps} Mb/s"}))
        assert given == default


def test_radios_are_those_of_ns3_unless_they_shall_follow_the_standard():
    """A sender 60 m away is hidden in ns-3, whose receivers find nothing below -82 dBm."""
    ns3, standard = (play(Hidden(Hidden.Params(spacing="30 m", duration="5 s", **preset)).setup())
                     for preset in ({}, {"preset": None}))
    assert standard["goodput_mbps"] > 2 * ns3["goodput_mbps"]


def test_a_shorter_slot_carries_more():
    long, short = (play(Saturation(Saturation.Params(stations=1, slot=slot)).setup())
                   for slot in ("20 us", "9 us"))
    assert (round(long["goodput_mbps"], 1), round(short["goodput_mbps"], 1)) == (18.6, 24.6)
    assert long == play(Saturation(Saturation.Params(stations=1)).setup())


def test_an_idle_bottleneck_takes_what_its_parts_take():
    """1502 B at 10 Mb/s, and 1 ms; ns-3 has 12 us more, of a line of 1 Gb/s in front of it."""
    found = play(Bottleneck(Bottleneck.Params(senders=1, load=0.5, arrivals="periodic")).setup())
    assert found["delay_p50_ms"] == pytest.approx(2.2016, abs=1e-6)


def test_the_sunflower_fills_its_disc_evenly():
    places = sunflower(200, 20.0)
    radii_m = sorted((x * x + y * y) ** 0.5 for x, y in places)
    assert radii_m[-1] <= 20.0
    assert radii_m[49] == pytest.approx(10.0, abs=0.1)  # a quarter of them within half the radius
    assert abs(sum(x for x, _ in places)) < 20 and abs(sum(y for _, y in places)) < 20
