"""In each network model a train loses the packets that chance or others take, and no more.

Frames and packets are conserved.
"""

from itertools import product

import numpy as np
import pytest
from lossy import Loses

from desim import plugins
from desim.ports import Drop, model_of
from desim.testing import Bench
from netmodels.multihop import Multihop
from netmodels.radio.dcf.radio import DcfRadio
from netmodels.radio.standards import A, psdu_bytes
from netmodels.tdma import Tdma

MS = 10**6
PLACES = {"a": (0.0, 0.0), "b": (20.0, 0.0), "c": (47.5, 0.0), "d": (90.0, 5.0),
          "e": (np.nan, np.nan)}
LINKS = "time_s,source,destination,delivery_ratio\n" + "".join(
    f"0,{source},{receiver},0.8\n" for source, receiver in product("abcd", repeat=2)
    if source != receiver)
RADIO = {"rate": "24 Mb/s", "retries": 2}

# Parameters by name, and whether a train's packets can have different fates.
MODELS = {
    "aloha": ({"rate": "54 Mb/s"}, True), "argos_rab": ({"range": "50 m", "size": "1 MB"}, False),
    "bus": ({"arbitration": "csma_cd", "queue_packets": 1000}, True),
    "cellular": ({"queue": "9 kB"}, True), "disk": ({"range": "50 m"}, False),
    "distance": ({"delivery": [["10 m", 0.9], ["60 m", 0.5]]}, True),
    "epidemic": ({"hop": "radio", "radio": RADIO, "lifetime": "20 s"}, True),
    "gz_rfcomms": ({"noise": "-60 dBm"}, True), "ideal": ({}, False),
    "ideal_mac": ({"range": "50 m"}, False), "ieee802154": ({"range": "50 m"}, True),
    "link": ({}, False), "lora": ({"gateway": "a"}, False),  # too long for it, all of them
    "multihop": ({"hop": "radio", "radio": RADIO, "routing": "static"}, True),
    "radio": (RADIO, True), "replay": ({"file": None}, True),
    "subt": ({"noise": "-75 dBm"}, True), "switch": ({}, False),
    "tdma": ({"cycle": 2, "slot": "1 ms", "range": "50 m"}, True),
    "webots_emitter": ({"range": "50 m"}, False)}


def test_all_models_are_here():
    assert set(MODELS) == set(plugins.available("network"))


@pytest.mark.parametrize("name", MODELS)
def test_frames_and_packets_are_conserved(name, tmp_path):
    params, parts = MODELS[name]
    if "file" in params:
        (tmp_path / "links.csv").write_text(LINKS)
        params = params | {"file": str(tmp_path / "links.csv")}
    cls = plugins.load("network", name)
    bench = Bench(model_of(cls, cls.Params(**params)), PLACES)
    sizes = {}
    for label, (source, packets, broadcast) in enumerate(
            product("abcde", (1, 2, 7, 20), (False, True))):
        others = [host for host in PLACES if host != source]
        receivers = others if broadcast else [others[label % 4]]
        sizes[label] = packets
        bench.send(label % 10 * 3 * MS, source, receivers, 1518 * packets - 700, packets, label,
                   broadcast)
    log, medium = bench.run(), bench.medium
    intended = 5 * 4 * (1 + 4)
    assert medium.in_flight() == 0 and len(log) == intended == medium.intended
    assert medium.delivered + sum(medium.dropped.values()) == intended
    assert medium.delivered == sum(fate.startswith("arrived") for *_, fate in log)
    assert medium.packets_intended == 5 * (1 + 2 + 7 + 20) * (1 + 4)
    partly = sum(len(lost) for *_, lost in bench.parts)
    whole = sum(sizes[label] for _, label, *_, fate in log if not fate.startswith("arrived"))
    assert sum(medium.packets_dropped.values()) == partly + whole
    assert medium.packets_delivered == medium.packets_intended - partly - whole
    assert bool(bench.parts) == parts
    assert all(0 < len(lost) < sizes[label] for label, _, lost in bench.parts)


# ------------------------------------------------------------------------------------- whole logs


def test_a_radio_gives_up_packets_one_by_one():
    """48 m at 24 Mb/s: about half of the full packets are not read. With seven tries hardly any
    packet is lost, with one as many as the errors say, and the train goes on to its end."""
    lost = {}
    for retries in 1, 7:
        bench = Bench(DcfRadio(DcfRadio.Params(standard="11a", rate="24 Mb/s", retries=retries)),
                      {"a": (0, 0), "b": (48, 0)})
        for label in range(20):
            bench.send(label * 1000 * MS, "a", "b", 50 * 1518, 50, label)
        assert len(bench.run()) == 20
        lost[retries] = bench.medium.packets_dropped.get("retry_limit", 0) / 1000
    share = float(bench.medium.model.signal(np.zeros(2), np.array([[48.0, 0.0]])).delivery[0])
    assert lost[1] == pytest.approx(1 - share, abs=0.05)
    assert lost[7] == pytest.approx((1 - share) ** 7, abs=0.02) and lost[7] < lost[1] / 10


def test_a_radio_sends_packets_of_the_sizes_that_they_have():
    """A full one and one of 110 B; two of the mean size would be 4 us longer."""
    radio = DcfRadio(DcfRadio.Params(standard="11a", rate="6 Mb/s"))
    bench = Bench(radio, {"a": (0, 0), "b": (9, 0)})
    bench.send(0, "a", ["b"], 1628, 2, broadcast=True)
    (time_ns, *_), = bench.run()
    air_ns = sum(A.airtime_ns(psdu_bytes(size_bytes, 1), A.rate(6)) for size_bytes in (1518, 110))
    mean_ns = 2 * A.airtime_ns(psdu_bytes(814, 1), A.rate(6))
    slots = (time_ns - air_ns - A.difs_ns) / A.slot_ns
    assert slots == int(slots) and (time_ns - mean_ns - A.difs_ns) % A.slot_ns


def test_a_broadcast_train_of_a_radio_loses_what_others_talk_into():
    """Two who do not hear each other: only one packet of the train meets the other's."""
    bench = Bench(DcfRadio(DcfRadio.Params(preset="ns3_3_44", standard="11a", rate="6 Mb/s")),
                  {"a": (0, 0), "b": (45, 0), "c": (90, 0)})
    bench.send(0, "a", ["b", "c"], 5 * 1518, 5, "train", broadcast=True)
    bench.send(3 * MS, "c", ["b"], 100, 1, "packet", broadcast=True)
    assert sorted((label, receiver, fate) for _, label, _, receiver, fate in bench.run()) == [
        ("packet", "b", "collision"), ("train", "b", "arrived in part"),
        ("train", "c", "out_of_reach")]
    (_, _, lost), = bench.parts
    assert lost == {1: "channel_error"}
    assert bench.medium.packets_dropped == {"collision": 1, "channel_error": 1, "out_of_reach": 5}


def test_a_train_in_slots_loses_what_others_send_in_them():
    slots = {"a": 0, "c": 0}
    bench = Bench(Tdma(Tdma.Params(cycle=1, slot="1 ms", slots=slots, range="11 m",
                                   interference="21 m")), {f"{name}": (10.0 * k, 0.0)
                                                           for k, name in enumerate("abcd")})
    bench.send(0, "a", ["b", "c"], 3 * 100, 3, "train", broadcast=True)
    bench.send(1 * MS, "c", "d", 100, 1, "packet")
    assert sorted(bench.run()) == [(2 * MS, "packet", "c", "d", "arrived"),
                                   (3 * MS, "train", "a", "b", "arrived in part"),
                                   (3 * MS, "train", "a", "c", "out_of_reach")]
    assert bench.parts == [("train", "b", {1: "collision"})]


class Hop(Loses):
    """Three in a row, and packets that get lost at each."""

    reasons = ("spilt",)

    def links(self):
        return np.array([0, 1, 1, 2]), np.array([1, 0, 2, 1]), np.ones(4)


class LastHop(Hop):
    """Nothing gets to the last one."""

    def send(self, frame):
        if frame.receivers != (2,):
            return super().send(frame)
        self._context.settle(frame, 2, Drop("spilt", tuple(range(frame.segments))))
        return None


def test_packets_that_are_lost_on_one_hop_are_not_sent_on_the_next():
    """Of six packets the first hop loses 1 and 3; the second one, which counts four, 0 and 2."""
    hop = Hop(r1=((1, 3),), r2=((0, 2),))
    bench = Bench(Multihop(Multihop.Params(routing="static"), hop), 3)
    bench.send(0, "host_1", "host_3", 5 * 1518 + 100, 6, "train")
    assert [fate for *_, fate in bench.run()] == ["arrived in part"]
    assert bench.parts == [("train", "host_3", dict.fromkeys((0, 1, 3, 4), "spilt"))]
    assert hop.given == [(6, 5 * 1518 + 100), (4, 3 * 1518 + 100)]


def test_a_train_that_loses_all_on_its_way_is_lost():
    bench = Bench(Multihop(Multihop.Params(routing="static"), LastHop(r1=((1,),))), 3)
    bench.send(0, "host_1", "host_3", 300, 3)
    assert [fate for *_, fate in bench.run()] == ["spilt"]
    assert bench.medium.packets_dropped == {"spilt": 3} and not bench.medium.in_flight()
