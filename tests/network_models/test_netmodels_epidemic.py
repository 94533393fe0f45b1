"""``epidemic``: what hosts carry, hand over and give up, on small lines that stand or move."""

from collections import Counter

import numpy as np
import pytest

from desim.engine.kernel import Phase
from desim.testing import Bench, check_network
from netmodels.disk import Disk
from netmodels.epidemic import Epidemic
from netmodels.multihop import Multihop

MS, S = 10**6, 10**9

NEAR = {"hop": "disk", "disk": {"range": "50 m", "rate": "8 Mb/s"}}  # 1 us a byte


def epidemic(**params):
    return Epidemic(Epidemic.Params(**NEAR | params))


def moved(bench, way):
    """With hosts at ``way(seconds)`` [hosts, 2] m, seen once a second."""
    known = {}
    bench.medium.positions = lambda time_ns: known.setdefault(
        time_ns // S, np.array(way(time_ns // S), float))
    return bench


def ferry(second):
    """a and b stand 1 km from each other; the ferry is at a for 10 s, and at b from 60 s on."""
    return [(0, 0), (1000, 0), (np.clip((second - 10) * 20, 0, 1000), 0)]


def ferried(**params):
    return moved(Bench(epidemic(**params), {"a": (0, 0), "b": (0, 0), "ferry": (0, 0)}), ferry)


def fates(bench, until_ns=400 * S):
    return {label: (fate, time_ns / S) for time_ns, label, _, _, fate in bench.run(until_ns)}


# ----------------------------------------------------------------------------------- the contract


@pytest.mark.parametrize("params", [{}, {"buffer": "50 kB"}, {"lifetime": "2 s"}], ids=str)
def test_it_keeps_the_contract(params):
    """Hosts that nobody meets: a host that says nothing would carry, and so change something."""
    check_network(Epidemic, hop="ideal_mac", ideal_mac={"range": "1 m"}, **params)


def crowd(**params):
    """Sixty messages in a crowd of four, some of whom meet some others only."""
    bench = Bench(Epidemic(Epidemic.Params(lifetime="20 s", **params)),
                  {f"h{k}": (30.0 * k, 0.0) for k in range(4)}, seed=5)
    for k in range(60):
        bench.send(k * 50 * MS, f"h{k % 4}", f"h{(k + 1 + k // 4 % 3) % 4}", 1000, label=k)
    return bench.run(40 * S), bench.medium


@pytest.mark.parametrize("params", [
    NEAR, NEAR | {"buffer": "5 kB"}, NEAR | {"patience": "1 ms"},
    {"hop": "radio", "radio": {"rate": "24 Mb/s"}},
    {"hop": "ideal_mac", "ideal_mac": {"range": "50 m", "interference": "50 m"}}], ids=str)
def test_every_message_has_one_fate_and_the_same_again(params):
    log, medium = crowd(**params)
    assert len(log) == 60 and not medium.in_flight()
    assert crowd(**params)[0] == log
    lost = Counter(fate for *_, fate in log if fate != "arrived")
    assert set(lost) <= {"expired", "buffer_full"}
    assert bool(lost) == ("buffer" in params)


# ----------------------------------------------------------------------- what is carried, how long


def test_a_ferry_carries_what_the_sender_could_never_send():
    bench = ferried()
    bench.send(0, "a", "b", 1000, label="there")
    bench.send(20 * S, "a", "b", 1000, label="too late")
    found = fates(bench)
    assert found["there"][0] == "arrived" and 58 <= found["there"][1] <= 60
    assert found["too late"] == ("expired", 320.0)


def test_nothing_is_carried_longer_than_its_lifetime():
    bench = ferried(lifetime="55 s")
    bench.send(0, "a", "b", 1000, label="old")
    bench.send(4 * S, "a", "b", 1000, label="young")
    found = fates(bench)
    assert found["old"] == ("expired", 55.0) and found["young"][0] == "arrived"


def test_a_full_buffer_gives_up_the_oldest():
    """The ferry holds two of three. The first one, which it has had, it does not ask for again, and
    the sender keeps it to its end."""
    bench = ferried(buffer="2 kB")
    for k in range(3):
        bench.send(2 * k * S, "a", "b", 1000, label=k)
    found = fates(bench)
    assert [found[k][0] for k in range(3)] == ["buffer_full", "arrived", "arrived"]


def test_a_message_larger_than_the_buffer_is_nobodys():
    bench = ferried(buffer="999 B")
    bench.send(S, "a", "b", 1000, label="large")
    assert fates(bench) == {"large": ("too_large", 1.0)}
    assert bench.medium.bytes_on_air == 0


def stopped(*times_s):
    """a and then the ferry stop."""
    bench = ferried()
    bench.send(0, "a", "b", 1000, label="message")
    for host, time_s in zip((0, 2), times_s, strict=False):
        bench.kernel.at(int(time_s * S), Phase.WORLD, 0,
                        lambda host: bench.medium.switched(host, False), host)
    return fates(bench)["message"]


def test_what_a_host_held_is_lost_when_it_stops():
    assert stopped(5)[0] == "arrived"
    assert stopped(5, 30) == ("relay_down", 30.0)


def test_a_broadcast_goes_one_hop():
    bench = ferried()
    bench.send(0, "a", ("b", "ferry"), 1000, label="all", broadcast=True)
    assert sorted(log[3:] for log in bench.run(S)) == [("b", "out_of_reach"), ("ferry", "arrived")]


# --------------------------------------------------------------------------- what it costs on air


class Counting(Disk):
    """Notes the size of each frame, and who sends it to how many."""

    def __init__(self, params):
        super().__init__(params)
        self.sent = []

    def send(self, frame):
        self.sent.append((frame.size_bytes, frame.source, len(frame.receivers)))
        super().send(frame)


def test_a_summary_a_request_and_a_copy_for_each_host_that_has_not_had_it():
    """Six within reach of each other: all others get the message from the first one, and all that
    hold it, but for its receiver, say so every second."""
    hop = Counting(Disk.Params(range="50 m", rate="8 Mb/s"))
    bench = Bench(Epidemic(Epidemic.Params(), hop), {f"h{k}": (k, 0.0) for k in range(6)})
    bench.send(0, "h0", "h5", 1000)
    bench.run(3 * S)
    copies = [frame for frame in hop.sent if frame[0] == 1000]
    summaries = [frame for frame in hop.sent if frame[2] == 5]
    requests = [frame for frame in hop.sent if frame[0] != 1000 and frame[2] == 1]
    assert copies == [(1000, 0, 1)] * 5 and len(requests) == 5
    assert {source for _, source, _ in summaries} == {0, 1, 2, 3, 4}
    assert {size_bytes for size_bytes, *_ in summaries + requests} == {50}
    assert bench.medium.model.control() == (len(summaries) + 5, 50 * (len(summaries) + 5))
    assert bench.medium.control_bytes == 50 * (len(summaries) + 5)


def test_the_air_is_busy_with_it_as_far_as_the_hop_knows():
    assert not hasattr(epidemic(), "busy_ns")
    bench = Bench(Epidemic(Epidemic.Params()), {"a": (0.0, 0.0), "b": (5.0, 0.0)})
    bench.send(0, "a", "b", 1000)
    bench.run(2 * S)
    assert 0 < bench.medium.model.busy_ns([0])[0] < 10 * MS


def test_who_holds_nothing_says_nothing():
    bench = ferried(lifetime="3 s")
    bench.run(10 * S)
    assert bench.medium.model.control() == (0, 0)
    bench.send(10 * S, "a", "b", 1000)
    bench.run(20 * S)
    said = bench.medium.model.control()
    assert said[0] > 0
    bench.run(100 * S)
    assert bench.medium.model.control() == said


# ------------------------------------------------------------------------------------ moving lines


def relay_race(second, speed_mps):
    """Five in a line, 100 m apart; each goes to the place of the next one and back in 20 s, and
    odd ones leave when even ones return: neighbours meet in turn, every 20 s."""
    way_m = speed_mps * min(second % 20, 20 - second % 20)
    return [(100 * k + (way_m if k % 2 == 0 else 100 - way_m), 0) for k in range(5)]


def raced(model, speed_mps=10):
    bench = moved(Bench(model, {f"h{k}": (0, 0) for k in range(5)}),
                  lambda second: relay_race(second, speed_mps))
    for label in range(20):
        bench.send(label * S, "h0", "h4", 1000, label=label)
    return fates(bench)


def in_time(found):
    """Neighbours are within 50 m from 8 to 13 s (even one behind) and from 18 to 23 s of every 20.
    What is there when the first meeting is over at 13 s is handed on at the beginning of the next
    three, and arrives within an interval of 38 s; what comes later, 20 s later."""
    begins = {label: 38 if label < 13 else 58 for label in range(20)}
    return all(fate == "arrived" and begins[label] <= time_s < begins[label] + 1.01
               for label, (fate, time_s) in found.items())


def test_a_line_that_is_never_connected_hands_over_at_every_meeting():
    assert in_time(raced(epidemic()))
    assert {fate for fate, _ in raced(Multihop(Multihop.Params(**NEAR, routing="static"))).values()
            } == {"no_path"}


def test_the_twin_a_tenth_slower_meets_later():
    assert not in_time(raced(epidemic(), speed_mps=9))
