"""Marks of packets: their access category, and who gets the medium of several of one host."""

import math

import pytest
from stations import air, same_power

import desim
from desim.errors import InputError
from desim.netcases.case import play
from desim.ports.cases import Flow, Setup
from desim.testing import Bench
from netmodels.radio.access_categories import BEACONS, categories, of_hostapd, rank_of
from netmodels.radio.dcf.stations import DONE, NEVER, RECEIVED
from netmodels.radio.radio import Radio
from netmodels.radio.standards import A, B

S = 10**9
NOWHERE = (math.nan, math.nan)


@pytest.mark.parametrize(("dscp", "rank"), [
    (0, 1), (8, 0), (10, 0), (16, 0), (24, 1), (34, 2), (46, 2), (48, 3), (56, 3)])
def test_the_category_of_a_mark_is_that_of_linux(dscp, rank):
    """The three highest bits are the user priority: EF (46) is video, CS6 (48) voice."""
    assert rank_of(dscp) == rank


@pytest.mark.parametrize(("standard", "video_us", "voice"), [(A, 3008, (3, 7)), (B, 6016, (7, 15))])
def test_the_numbers_of_categories_are_those_of_linux(standard, video_us, voice):
    background, best_effort, video, urgent = categories(standard)
    assert [one.aifsn for one in categories(standard)] == [7, 3, 2, 2]
    assert background.cw_max == best_effort.cw_max == 1023
    assert (video.txop_ns, urgent[1:3]) == (video_us * 1000, voice)


@pytest.mark.parametrize(("standard", "slots"), [
    (A, [(7, 15, 1023), (3, 15, 63), (1, 7, 15), (1, 3, 7)]),
    (B, [(7, 31, 1023), (3, 31, 127), (1, 15, 31), (1, 7, 15)])])
def test_the_numbers_of_an_access_point_are_those_of_hostapd(standard, slots):
    """tx_queue_data3 to 0 of hostapd.conf, with its notes for 802.11b."""
    assert [one[:3] for one in of_hostapd(standard)] == slots
    assert [one.txop_ns for one in of_hostapd(standard)] == [
        one.txop_ns for one in categories(standard)]


@pytest.mark.parametrize(("given", "station", "access_point"), [
    ({}, (2, 3, 7), (1, 3, 7)), ({"preset": "ns3_3_44"}, (2, 3, 7), (2, 3, 7))])
def test_access_points_have_hostapds_and_stations_their_own(given, station, access_point):
    """ns-3's access points have those of stations."""
    radio = Radio.build(Radio.Params(
        **given, standard="11n", channel=36, infrastructure={"wired": ["base"]},
        access_points=[{"at": ["0 m", "0 m"], "channel": 36}]))
    Bench(radio, {"base": NOWHERE, "a": (5, 0)})
    voice = [radio._radio.access_of(host, 3)[:3] for host in ("a", "ap_0")]
    assert voice == [station, access_point]
    best_effort = [radio._radio.access_of(host).cw_max for host in ("a", "ap_0")]
    assert best_effort == [1023, 1023 if given else 63]


def test_of_two_categories_that_would_begin_together_the_higher_one_does():
    """Both packets come while the medium is idle: the lower one backs off, as after a collision."""
    stations = air(A, same_power(2))
    first = stations.contend(0, categories(A)[2], 1)
    second = stations.contend(0, categories(A)[3], 2)
    for station in first, second:
        stations.enqueue(10**9, station, 1, 264, A.rate(6))
    arrived = []
    while stations.next_ns < NEVER:
        arrived += [(station, time_ns) for time_ns, what, station, *_ in stations.advance(
            stations.next_ns) if what == RECEIVED]
    assert [station for station, _ in arrived] == [second, first]
    assert stations.counts(2 * 10**9).transmitted.tolist() == [2, 0]
    assert stations.counts(2 * 10**9).failures.tolist() == [0, 0]  # nothing collided on the air


def delays_ms(mark=0, queue="fifo"):
    """Mean delays of 50 packets a second to each of two stations, the second with a ``mark``,
    beside a saturated flow to the first one."""
    radio = Radio.build(Radio.Params(
        standard="11n", mcs=4, infrastructure={"wired": ["base"], "queue": queue},
        access_points=[{"at": ["0 m", "0 m"], "channel": 36}], channel=36))
    flows = [Flow("base", ("a",), 1046, 1000, "poisson", 200_000),
             Flow("base", ("b",), 246, 200, "poisson", 20_000_000, dscp=mark)]
    found = play(Setup(radio, {"base": NOWHERE, "a": (5, 0), "b": (0, 5)}, flows, 4 * S, S))
    return found["delay_mean_ms_by_mark"]


def test_an_access_point_has_a_queue_for_each_category():
    """Behind what one category has too much of, the other ones do not wait."""
    assert delays_ms(mark=48)["48"] < 5
    assert delays_ms()["0"] > 50


@pytest.mark.parametrize(("transport", "middleware"), [
    ("datagram", "direct"), ("stream", "direct"), ("stream", "ros1")])
def test_the_mark_of_a_topic_is_that_of_its_packets(transport, middleware, monkeypatch, repository,
                                                    tmp_path):
    """TCP's acknowledgements have none: they carry no message."""
    marks = []
    monkeypatch.setattr("netmodels.infrastructure.outlets.rank_of",
                        lambda dscp: marks.append(dscp) or rank_of(dscp))
    desim.run(desim.load(repository / "scenarios/camera_beside_commands.yaml", [
        "stop.elapsed=2 s", f"middleware={middleware}", "topics={cmd: {dscp: 48}}",
        "robot.publishes=[{topic: cmd, "
        f"size: 100 B, rate: 20 Hz, to: others, transport: {transport}}}]"]), out=tmp_path)
    assert 48 in marks
    assert middleware == "direct" or 0 in marks


def test_without_qos_there_is_no_category():
    with pytest.raises(InputError, match="access_category: 11a has none"):
        Radio.build(Radio.Params(standard="11a", access_category="video"))
    assert Radio.build(Radio.Params(standard="11a", qos=True, access_category="video"))


def test_a_beacon_comes_before_all_that_waits():
    """Behind a frame of another station the medium is idle for PIFS; data wait for DIFS and slots.
    """
    stations = air(A, same_power(3))
    beacons = stations.contend(0, BEACONS, 1)
    stations.enqueue(10**9, 2, -1, 1000, A.rate(6))
    for _ in range(5):
        stations.enqueue(10**9 + 10_000, 0, -1, 264, A.rate(6))
        stations.enqueue(10**9 + 10_000, 1, -1, 264, A.rate(6))
    stations.enqueue(10**9 + 10_000, beacons, -1, 138, A.rate(6))
    ends = []
    while stations.next_ns < NEVER:
        ends += [(station, time_ns) for time_ns, what, station, *_ in stations.advance(
            stations.next_ns) if what == DONE]
    assert [station for station, _ in ends[:2]] == [2, beacons]
    pifs_ns = A.sifs_ns + A.slot_ns
    assert ends[1][1] - ends[0][1] == pifs_ns + A.airtime_ns(138, A.rate(6))


def test_access_points_send_beacons_so():
    """Also without access categories: 802.11a, and a medium without marks."""
    radio = Radio.build(Radio.Params(
        standard="11a", infrastructure={"wired": ["base"]}, channel=36,
        access_points=[{"at": ["0 m", "0 m"], "channel": 36}]))
    bench = Bench(radio, {"base": NOWHERE, "a": (5, 0)})
    bench.run(S)
    stations = bench.medium.model._radio.air.stations
    assert len(stations.radios) == 4  # the stations, the access point and its beacons
    assert bench.medium.model.control()[0] == 10
    assert stations.counts(S).transmitted.tolist() == [0, 0, 0]  # they are no data
