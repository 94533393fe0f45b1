"""``radio`` as a network model: whole logs on the bench, and what it makes of the stations."""

from collections import Counter
from dataclasses import replace

import numpy as np
import pytest
from stations import LINKS, Flow, rows
from stations import UDP_BYTES as UDP
from test_radio_pathloss import room

from desim.engine.kernel import Kernel
from desim.engine.streams import Streams
from desim.engine.trace import Names
from desim.errors import InputError
from desim.network.medium import Medium
from desim.network.passages import Passages
from desim.ports.time_parts import TimePart
from desim.testing import Bench, check_network
from netmodels.radio.dcf.radio import DcfRadio
from netmodels.radio.dcf.stations import Stations
from netmodels.radio.standards import A, G

MS = 10**6


def radio(**params):
    return DcfRadio(DcfRadio.Params(**params))


def fates(log):
    return [(receiver, fate) for _, _, _, receiver, fate in log]


@pytest.mark.parametrize("params", [
    {}, {"standard": "11b", "rate": "11 Mb/s", "queue": 3, "update": "10 ms"},
    {"standard": "11a", "rate": "6 Mb/s", "rts": "500 B", "walls": None,
     "path_loss": {"model": "free_space", "frequency": "5180 MHz"}},
    {"path_loss": {"model": "fixed", "total": "60 dB"}, "reception": {"noise_figure": "3 dB"}},
], ids=["default", "11b", "11a", "fixed"])
def test_it_keeps_the_contract(params):
    check_network(DcfRadio, **params)


def test_one_packet_in_an_idle_medium_takes_its_airtime():
    bench = Bench(radio(standard="11a", rate="24 Mb/s"), {"a": (0, 0), "b": (9, 0)})
    bench.send(MS, "a", "b", UDP)
    assert bench.run() == [(MS + A.airtime_ns(1064, A.rate(24)), None, "a", "b", "arrived")]


def test_the_next_packet_waits_for_acknowledgement_difs_and_backoff():
    bench = Bench(radio(), {"a": (0, 0), "b": (5, 0)})
    for label in range(2):
        bench.send(MS, "a", "b", UDP, label=label)
    (first_ns, *_), (second_ns, *_) = bench.run()
    air_ns = G.airtime_ns(1064, G.rate(54))
    slots, rest = divmod(second_ns - first_ns - air_ns - G.sifs_ns - G.difs_ns
                         - G.airtime_ns(14, G.rate(24)), G.slot_ns)
    assert first_ns == MS + air_ns and rest == 0 and 0 <= slots <= G.cw_min


def test_a_broadcast_reaches_those_who_can_find_it():
    """51.4 m is within reach, 52 m is not; 6 Mb/s, the lowest rate of OFDM."""
    bench = Bench(radio(**LINKS), {"a": (0, 0), "b": (9, 0), "c": (0, 51.4), "d": (-52, 0),
                            "e": (np.nan, np.nan)})
    bench.send(0, "a", list("bcde"), UDP, broadcast=True)
    log = bench.run()
    assert {time_ns for time_ns, *_ in log} == {G.airtime_ns(1064, G.rate(6))}
    assert sorted(fates(log)) == [("b", "arrived"), ("c", "arrived"), ("d", "out_of_reach"),
                                  ("e", "out_of_reach")]
    assert 51.4 < bench.medium.model.reach_m < 52


def test_whoever_is_far_away_gets_seven_tries():
    bench = Bench(radio(), {"a": (0, 0), "b": (200, 0)})
    bench.send(0, "a", "b", UDP)
    assert fates(bench.run()) == [("b", "retry_limit")]
    counts = bench.medium.model._air.stations.counts(bench.kernel.now_ns)
    assert (counts.transmitted.tolist(), counts.dropped.tolist()) == ([7, 0], [1, 0])


@pytest.mark.parametrize("params", [
    {}, {"standard": "11a"}, {"standard": "11b", "rate": "11 Mb/s"}, {"rts": "500 B"}],
    ids=["11g", "11a", "11b", "rts"])
def test_what_is_acknowledged_has_not_failed(params):
    """Also where nothing comes after it, and where there is one attempt only."""
    bench = Bench(radio(retries=1, **params), {"a": (0, 0), "b": (5, 0)})
    for k in range(3):
        bench.send(k * 100 * MS, "a", "b", UDP)
    assert fates(bench.run()) == [("b", "arrived")] * 3
    counts = bench.medium.model._air.stations.counts(bench.kernel.now_ns)
    assert (counts.transmitted[0], counts.failures[0], counts.dropped[0]) == (3, 0, 0)


def test_a_full_queue_refuses_and_has_room_again():
    bench = Bench(radio(queue=2), {"a": (0, 0), "b": (5, 0)})
    for label in range(4):
        bench.send(0, "a", "b", UDP, label=label)
    bench.send(100 * MS, "a", "b", UDP, label="later")
    assert [(label, fate) for _, label, _, _, fate in bench.run()] == [
        (2, "queue_full"), (3, "queue_full"), (0, "arrived"), (1, "arrived"), ("later", "arrived")]


def test_what_waits_too_long_is_not_sent():
    """11b at 1 Mb/s: a frame of 1064 B takes 8.7 ms."""
    bench = Bench(radio(standard="11b", rate="1 Mb/s", constants={"lifetime": "20 ms"}), 4)
    for label in range(5):
        bench.send(0, "host_1", ["host_2"], UDP, label=label, broadcast=True)
    bench.send(500 * MS, "host_1", "host_2", UDP, label="later")
    assert [(label, fate) for _, label, _, _, fate in bench.run()] == [
        (0, "out_of_reach"), (1, "out_of_reach"), (2, "out_of_reach"), (3, "expired"),
        (4, "expired"), ("later", "expired")]  # in its third try


@pytest.mark.parametrize("reach_m", [5, 200])
def test_packets_of_a_train_that_is_too_old_are_not_sent(reach_m):
    """The rest of it, even amid a packet's tries; without a lifetime all of them are sent."""
    def last(**constants):
        bench = Bench(radio(constants=constants), {"a": (0, 0), "b": (reach_m, 0)},
                      passages=Passages())
        bench.send(0, "a", "b", 100 * UDP, 100)
        (time_ns, *_, fate), = bench.run()
        return time_ns / MS, fate, bench.parts, bench.spent

    waiting_ms, fate, parts, spent = last(lifetime="20 ms")
    assert 20 < waiting_ms < 35
    assert last()[0] > 1.2 * waiting_ms
    if reach_m == 200:
        assert (fate, parts, spent) == ("expired", [], [])
    else:
        (*_, stamps), = spent
        assert [stamp.part for stamp in stamps] == [TimePart.CONTENTION, TimePart.AIRTIME]
        (_, _, lost), = parts
        assert fate == "arrived in part"
        assert lost == dict.fromkeys(range(min(lost), 100), "expired") and 40 < min(lost) < 60


def test_two_who_begin_together_collide_and_a_third_hears_neither():
    bench = Bench(radio(path_loss={"model": "fixed", "total": "60 dB"}), 3)
    bench.send(0, "host_1", ["host_2", "host_3"], UDP, broadcast=True)
    bench.send(0, "host_2", ["host_1", "host_3"], UDP, broadcast=True)
    assert Counter(fates(bench.run())) == {("host_1", "collision"): 1, ("host_2", "collision"): 1,
                                           ("host_3", "collision"): 2}


def test_a_broadcast_train_arrives_whole_or_not_at_all():
    bench = Bench(radio(), {"a": (0, 0), "b": (9, 0)})
    bench.send(0, "a", ["b"], 10 * UDP, 10, broadcast=True)
    (time_ns, *_, fate), = bench.run()
    assert fate == "arrived" and time_ns > 10 * G.airtime_ns(1064, G.rate(6))


def test_walls_are_in_the_way_and_doors_open():
    """30 m: -75 dBm, that is 7 dB above where a frame is found."""
    bench = Bench(radio(**LINKS), {"a": (0, 0), "b": (30, 0)})
    walls = room("brick")
    bench.send(0, "a", ["b"], 100, label="through the wall", broadcast=True)
    bench.send(10 * MS, "a", ["b"], 100, label="door open", broadcast=True)
    bench.medium._place.obstacles = walls
    bench.run(5 * MS)
    bench.medium._place.obstacles = replace(room(), epoch=1)
    assert [fate for *_, fate in bench.run()] == ["out_of_reach", "arrived"]


def test_walls_can_be_left_out():
    bench = Bench(radio(walls=None), {"a": (0, 0), "b": (30, 0)})
    bench.medium._place.obstacles = room("brick")
    bench.send(0, "a", ["b"], 100, broadcast=True)
    assert fates(bench.run()) == [("b", "arrived")]


def test_what_is_sent_in_one_instant_is_foreseen_once(monkeypatch):
    searches = []
    foresee = Stations.next_ns.fget
    monkeypatch.setattr(Stations, "next_ns", property(
        lambda self: searches.append(self._next_ns is None) or foresee(self)))
    bench = Bench(radio(path_loss={"model": "fixed", "total": "60 dB"}), 30)
    for number in range(2, 31):
        bench.send(MS, f"host_{number}", "host_1", UDP)
    bench.run(MS)
    assert sum(searches) <= 2


class Saturated(Bench):
    """``host_1`` is sent to by all others, who have two packets in their queues always."""

    def offer(self, source):
        self.medium.transmit(source, (0,), UDP, 1, False, self, (None, source))

    def arrived(self, token, receiver):
        self.offer(token[1])

    def lost(self, token, receiver, reason):
        self.offer(token[1])


def thirty_saturated(seconds=5, **params):
    """Mb/s of payload through the whole medium."""
    bench = Saturated(radio(path_loss={"model": "fixed", "total": "60 dB"}, **params), 31)
    for source in list(range(1, 31)) * 2:
        bench.offer(source)
    bench.run(seconds * 10**9)
    return bench.medium.delivered * 8e-3 / seconds


def test_thirty_saturated_stations_as_in_ns3(reference):
    table = rows(reference / "ns3" / "s3_saturation_raw_runs.csv", mode="ErpOfdmRate54Mbps",
                 topo="sink-fixed", n="30")
    expected_mbps = np.mean([float(row["agg_goodput_mbps"]) for row in table])
    assert thirty_saturated(preset="ns3_3_44") == pytest.approx(expected_mbps, rel=0.015)
    assert 0.975 < thirty_saturated() / thirty_saturated(preset="ns3_3_44") < 0.995


def test_a_preset_fills_what_is_not_given():
    params = DcfRadio.Params(preset="ns3_3_44", retries=4, reception={
        "energy": "-70 dBm", "constants": {"heard": "-99 dBm"}})
    assert params.reception.constants.unaware and params.constants.window_failures == 8
    assert params.retries == 4 and params.reception.energy_dbm == -70
    assert params.reception.constants.heard_dbm == -99
    assert params.broadcast_rate_bps == 1e6
    slow = DcfRadio.Params(preset="ns3_3_44", standard="11a", rate="6 Mb/s")
    assert slow.broadcast_rate_bps == 6e6
    plain = DcfRadio.Params()
    assert not plain.reception.constants.unaware and plain.constants.window_failures is None
    again = DcfRadio.Params(**params.model_dump(by_alias=True))
    assert again == params


def test_a_preset_that_there_is_not():
    with pytest.raises(ValueError, match="ns3_3_44"):
        DcfRadio.Params(preset="ns4")


def test_who_is_on_another_channel_hears_nothing():
    bench = Bench(radio(channels={"c": 6, "d": 6}), {"a": (0, 0), "b": (9, 0), "c": (5, 5),
                                                     "d": (9, 9)})
    bench.send(0, "a", ["b", "c"], UDP, broadcast=True)
    bench.send(0, "c", ["a", "b", "d"], UDP, broadcast=True)
    bench.send(100 * MS, "a", "d", UDP)
    log = bench.run()
    assert log[-1][-1] == "retry_limit"
    assert {(source, receiver): fate for _, _, source, receiver, fate in log[:-1]} == {
        ("a", "b"): "arrived", ("a", "c"): "out_of_reach", ("c", "d"): "arrived",
        ("c", "a"): "out_of_reach", ("c", "b"): "out_of_reach"}
    assert len({time_ns for time_ns, *_ in log[:-1]}) == 1, "side by side"


def goodput(*flows, **channels):
    """Packets in a second of each flow (channel, source, destination) between four hosts; there is
    a medium for each channel."""
    kernel, names, streams = Kernel(), Names(), Streams(1)
    media = {channel: Medium(f"wifi_{channel}", radio(path_loss={"model": "fixed",
                                                                 "total": "60 dB"},
                                                      channel=channel, channels=channels),
                             kernel=kernel, names=names, streams=streams, hosts=list("abcd"))
             for channel in sorted({channel for channel, _, _ in flows})}
    running = [Flow(media[channel], source, dest) for channel, source, dest in flows]
    kernel.run(10**9)
    return [flow.received for flow in running]


def test_two_pairs_share_a_channel_and_not_two():
    (alone,) = goodput((1, 0, 1))
    assert sum(goodput((1, 0, 1), (1, 2, 3))) < 1.15 * alone
    assert goodput((1, 0, 1), (1, 2, 3), c=6, d=6) == pytest.approx([alone, alone], rel=0.02)


def test_a_host_with_two_radios_works_on_both_channels_at_once():
    (alone,) = goodput((1, 0, 1))
    assert goodput((1, 0, 1), (11, 0, 2)) == pytest.approx([alone, alone], rel=0.02)
    assert goodput((11, 0, 1), (1, 2, 0)) == pytest.approx([alone, alone], rel=0.02)


def test_hosts_on_different_channels_are_apart_for_the_monitor():
    bench = Bench(radio(channels={"host_3": 6}), 3)
    assert bench.medium.linked(np.arange(3)).tolist() == [
        [True, True, False], [True, True, False], [False, False, True]]
    assert Bench(radio(), 3).medium.linked(np.arange(3)).all()


@pytest.mark.parametrize(("params", "says"), [
    ({"channels": {"host_2": 3}}, r"\.channels: 1 and 3 overlap"),
    ({"channels": {"host_2": 99}}, r"\.channels\.host_2: there is no channel 99 of 20 MHz in "
                                    r"2\.4 GHz; allowed: 1 to 14"),
    ({"channel": 99}, r"\.channel: there is no channel 99 of 20 MHz in 2\.4 GHz; "
     "allowed: 1 to 14"),
    ({"channels": {"host_7": 6}}, r"\.channels: no host 'host_7'"),
    ({"rate": "10 Mb/s"}, r"\.rate: 10 Mb/s is no rate of 11g; allowed: 1 Mb/s, 2 Mb/s"),
    ({"standard": "11b", "rate": "11 Mb/s", "broadcast_rate": "6 Mb/s"}, r"\.broadcast_rate: 6 Mb"),
])
def test_rates_that_there_are_not(params, says):
    with pytest.raises(InputError, match=says):
        Bench(radio(**params))
