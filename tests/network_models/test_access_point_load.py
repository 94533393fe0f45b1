"""Access points under load: trains of saturated flows, and queues that are shorter than these."""

from types import SimpleNamespace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from desim.netcases.case import play
from desim.ports.cases import NOWHERE, Flow, Setup
from netmodels.cases.traffic import SAME_POWER
from netmodels.infrastructure.fq_codel import FqCodel, FqCodelConstants
from netmodels.infrastructure.packet_queue import PlainQueue, Waiting
from netmodels.radio.radio import Radio

S = 10**9
UDP = 1046


def loaded(stations, train, down=False, backlog=128, seconds=1, **params):
    """Saturated 802.11n stations under an access point, as ``desim validate`` has them."""
    radio = Radio.build(Radio.Params.model_validate({
        "preset": "ns3_3_44", "constants": {"apart": False},
        "standard": "11n", "channel": 36, "mcs": 7, "path_loss": SAME_POWER,
        "queue": 10_000, "access_points": [{"at": ["0 m", "0 m"], "channel": 36}],
        "infrastructure": {"wired": ["server"], "queue": "fifo",
                           "wires": {"rate": "100 Gb/s", "propagation": "0 ns"},
                           "constants": {"beacon_frame": None}}, **params}))
    hosts = [f"station_{k}" for k in range(stations)]
    flows = [Flow(*(("server", (host,)) if down else (host, ("server",))), UDP, 1000,
                  backlog=backlog, train=train) for host in hosts]
    return play(Setup(radio, dict.fromkeys([*hosts, "server"], NOWHERE), flows,
                      (1 + seconds) * S, S))


# ----------------------------------------------------------------------------------------- trains


def test_trains_carry_what_packets_carry():
    """Stations that always have more than an aggregate begin the same exchanges, whether they send
    packets or two trains; only at the ends of the measurement parts of trains count elsewhere."""
    packets, trains = loaded(5, 1), loaded(5, 65)
    assert trains["attempts"] == packets["attempts"]
    assert trains["failure_rate"] == packets["failure_rate"]
    assert trains["goodput_mbps"] == pytest.approx(packets["goodput_mbps"], rel=0.01)
    packets, trains = (
        loaded(5, train, down=True, seconds=3) for train in (1, 65))
    assert trains["goodput_mbps"] == pytest.approx(packets["goodput_mbps"], rel=0.005)


def test_the_twin_with_one_train_at_a_time_shows():
    """Behind each aggregate of 41 packets there is one of three."""
    packets, twin = loaded(1, 1), loaded(1, 44, backlog=42)
    assert twin["goodput_mbps"] != pytest.approx(packets["goodput_mbps"], rel=0.01)


def test_stations_without_places_hang_on_it_where_the_path_loss_is_fixed():
    """An aggregate of 41 packets, 135 us each at 65 Mb/s, and 0.2 ms around it."""
    assert loaded(1, 1)["goodput_mbps"] == pytest.approx(58.4, rel=0.01)
    assert loaded(1, 1, path_loss={"model": "log_distance"})["delivered"] == 0


# ----------------------------------------------------------------------------------- short queues


@pytest.mark.parametrize("train", [1, 65])
def test_a_queue_that_is_shorter_than_a_backlog_stays_full(train):
    """Of 390 packets from the server 100 wait at the access point, whose radio never runs dry; each
    of three flows tries again every 10 ms at most."""
    found = loaded(3, train, down=True, queue=100)
    assert found["goodput_mbps"] == pytest.approx(58.4, rel=0.03)
    assert found["lost"]["downlink_queue_full"] > 0
    assert found["frames"] < found["delivered"] + 3 * 100 * train * 4 + 390


@given(st.lists(st.tuples(st.integers(1, 9), st.integers(0, 5)), max_size=20), st.integers(1, 20))
def test_runs_of_packets_wait_as_single_ones_would(steps, limit):
    """Packets come in runs, and leave in runs of what the radio takes in."""
    queue, single, inside = PlainQueue(limit), [], 0
    hops = [SimpleNamespace(sizes=range(100, 100 + count), broadcast=False, receivers=(1,))
            for count, _ in steps]
    for number, (hop, (count, takes)) in enumerate(zip(hops, steps, strict=True)):
        refused = queue.push(number, Waiting(hop, 0, sum(hop.sizes), number, count), inside)
        fit = min(max(limit - inside - len(single), 0), count)
        assert [(one.number, one.packets, why) for one, why in refused] == (
            [(fit, count - fit, "queue_full")] if fit < count else [])
        single += [(hop, packet, number) for packet in range(fit)]
        while takes and (run := queue.pop(number, [], lambda *_, most=takes: most)):
            taken, single = single[:run.packets], single[run.packets:]
            assert taken == [(run.hop, packet, run.since_ns) for packet in range(
                run.number, run.number + run.packets)]
            assert run.size_bytes == sum(100 + packet for _, packet, _ in taken)
            takes, inside = takes - run.packets, (inside + run.packets) % 5
    assert [(one.hop, one.number + k, one.since_ns) for one in queue.take_out(None)
            for k in range(one.packets)] == single
    assert queue.pop(0, [], lambda *_: 9) is None


_MS = st.integers(0, 40)
_STEPS = st.lists(st.tuples(st.sampled_from("aab"), st.integers(0, 8), st.integers(0, 7), _MS),
                  max_size=60)


@given(_STEPS, st.sampled_from(["0 B", "1514 B"]))
def test_runs_wait_for_their_turns_and_drops_as_single_packets_would(steps, spare):
    """Two flows in a short queue, of which a radio takes in up to 7 packets at a time."""
    constants = FqCodelConstants(target="5 ms", interval="20 ms", limit=25, spare=spare)
    together, singly = FqCodel(constants), FqCodel(constants)
    now_ms = 0
    for number, (flow, count, most, wait_ms) in enumerate(steps):
        now_ms += wait_ms
        now_ns = now_ms * 10**6
        sizes = (1500,) * (count - 1) + (number % 1500 + 1,)
        hop = SimpleNamespace(trip=SimpleNamespace(flow=flow), receivers=(1,), broadcast=False,
                              sizes=sizes)
        run = Waiting(hop, 0, sum(sizes), now_ns, count)
        dropped, alone = [], []
        if count:
            dropped += together.push(now_ns, [run])
            alone += singly.push(now_ns, run.singly())
        left = []
        while len(left) < most and (some := together.pop(
                now_ns, dropped, lambda _, most=most, left=left: most - len(left))):
            left += some.singly()
        right = [one for _ in range(most) if (one := singly.pop(now_ns, alone))]
        assert left == right
        assert [(one, why) for some, why in dropped for one in some.singly()] == alone
    for name in singly._flows:
        ours, theirs = together._flows[name], singly._flows[name]
        assert (ours.deficit_bytes, ours.bytes, ours._above_ns, ours._dropping) == (
            theirs.deficit_bytes, theirs.bytes, theirs._above_ns, theirs._dropping)
    ours, theirs = together._backlog, singly._backlog
    assert (together._new, together._old, ours.packets, ours.bytes) == (
        singly._new, singly._old, theirs.packets, theirs.bytes)
