"""``multihop``: routes over single hops, what they carry, and how they are found and repaired."""

from collections import Counter

import numpy as np
import pytest
from stations import LINKS

from desim.errors import InputError
from desim.netcases.case import play
from desim.scenario.complaints import validated
from desim.testing import Bench, check_case, check_network
from desim.units import airtime_ns
from netmodels.access_link import AccessLink
from netmodels.cases import chain
from netmodels.cases.chain import RelayChain
from netmodels.ideal_mac import IdealMac
from netmodels.multihop import Multihop
from netmodels.multihop.batman import Bundle
from netmodels.multihop.routes import LinkQuality, Routes
from netmodels.radio.dcf.radio import DcfRadio
from netmodels.tdma import Tdma

MS, S = 10**6, 10**9
NEAR = {"range": "11 m", "interference": "21 m", "rate": "8 Mb/s"}  # 1 us a byte
US = 1000


def multihop(routing="static", hop="ideal_mac", hop_limit=50, batman=None, static=None, **params):
    return Multihop(Multihop.Params(
        hop=hop, routing=routing, hop_limit=hop_limit, batman=batman or {}, static=static or {},
        **{hop: NEAR | params if hop in ("ideal_mac", "tdma") else params}))


def row(count, spacing_m=10.0):
    return {f"h{k}": (spacing_m * k, 0.0) for k in range(count)}


# ----------------------------------------------------------------------------------- the contract


@pytest.mark.parametrize("params", [
    {"hop": hop, "routing": "static", **more} for hop, more in [
        ("disk", {}), ("ideal_mac", {}), ("tdma", {}), ("radio", {}),
        ("disk", {"disk": {"range": "70 m"}, "static": {"metric": "hops"}}),
        ("disk", {"disk": {"range": "70 m"}, "hop_limit": 1})]
], ids=str)
def test_it_keeps_the_contract(params):
    check_network(Multihop, **params)


@pytest.mark.parametrize(("cls", "params"), [
    (IdealMac, {}), (IdealMac, {"range": "70 m", "queue": 2}), (Tdma, {}),
    (Tdma, {"cycle": 2, "slot": "1 ms"}), (Tdma, {"slot": "1 us"})])
def test_the_macs_keep_the_contract(cls, params):
    check_network(cls, **params)


def load(routing):
    """Frames between all hosts of a grid, while the protocol runs: the log, and the medium."""
    places = {f"h{3 * y + x}": (10.0 * x, 10.0 * y) for x in range(3) for y in range(3)}
    bench = Bench(multihop(routing), places, seed=3)
    for k in range(200):
        bench.send(5 * S + k * 7 * MS, f"h{k % 9}", f"h{(k + 1 + k // 9) % 9}"
                   if (1 + k // 9) % 9 else "h8" if k % 9 < 8 else "h0", 500, label=k)
    return bench.run(20 * S), bench.medium


@pytest.mark.parametrize("routing", ["static", "batman"])
def test_every_frame_has_one_fate_and_the_same_again(routing):
    log, medium = load(routing)
    assert len(log) == 200 and not medium.in_flight()
    assert Counter(fate for *_, fate in log) == {"arrived": 200}
    assert load(routing)[0] == log


# ------------------------------------------------------------------------------- store and forward


def test_a_frame_is_sent_anew_by_each_host_on_its_way():
    bench = Bench(multihop(), row(4))
    bench.send(MS, "h0", "h3", 500, label="far")
    bench.send(MS, "h3", "h2", 100, label="near")
    assert bench.run() == [(MS + 3 * 500 * US, "far", "h0", "h3", "arrived"),
                           (MS + 3 * 500 * US + 100 * US, "near", "h3", "h2", "arrived")]


def test_what_the_first_hop_refuses_was_never_sent_what_a_relay_refuses_was():
    """Room for one frame: of four at once one is sent. At a relay, where two senders meet, what
    does not fit any more was on the air."""
    bench = Bench(multihop(queue=1), row(3))
    for _ in range(4):
        bench.send(0, "h0", "h2", size_bytes=1000)
    bench.run()
    medium = bench.medium
    assert medium.dropped["queue_full"] == 3
    assert (medium.refused_bytes, medium.bytes_on_air) == (3000, 1000)

    bench = Bench(multihop(queue=1), {**row(3), "h9": (10.0, 10.0)})
    for source in ("h0", "h9"):
        bench.send(0, source, "h2", size_bytes=1000)
    bench.send(1500 * US, "h1", "h2", size_bytes=1000)
    bench.run()
    medium = bench.medium
    assert medium.dropped["relay_queue_full"] == 1
    assert (medium.refused_bytes, medium.bytes_on_air) == (0, 3000)


def test_a_frame_may_make_so_many_hops():
    for limit, fate in (2, "hop_limit"), (3, "arrived"):
        bench = Bench(multihop(hop_limit=limit), row(4))
        bench.send(0, "h0", "h3", 500)
        assert bench.run() == [(min(limit, 3) * 500 * US, None, "h0", "h3", fate)]


def test_where_there_is_no_path_nothing_is_sent():
    bench = Bench(multihop(), {"a": (0, 0), "b": (12, 0), "c": (np.nan, np.nan)})
    bench.send(0, "a", "b", 500)
    bench.send(0, "a", "c", 500)
    assert bench.run() == [(0, None, "a", "b", "no_path"), (0, None, "a", "c", "no_path")]
    assert bench.medium.model.separates(0, 1)


def test_a_broadcast_goes_one_hop():
    bench = Bench(multihop(), row(3))
    bench.send(0, "h0", ["h1", "h2"], 500, broadcast=True)
    assert bench.run() == [(500 * US, None, "h0", "h2", "out_of_reach"),
                           (500 * US, None, "h0", "h1", "arrived")]


def test_a_relay_that_goes_down_takes_what_it_holds_along():
    bench = Bench(multihop(), row(4))
    bench.send(0, "h0", "h3", 500)
    bench.kernel.at(700 * US, 0, 0, lambda _: bench.medium.model.switched(2, False))
    assert bench.run() == [(1000 * US, None, "h0", "h3", "relay_down")]


def test_the_hops_may_be_any_model_that_delivers_later():
    """A model that somebody else has made: a link of 8 Mb/s to everybody, 1 ms long."""
    link = AccessLink(AccessLink.Params(rate="8 Mb/s", latency="1 ms"))
    link.links = lambda: (np.array([0, 1, 1, 2]), np.array([1, 0, 2, 1]), np.ones(4))
    bench = Bench(Multihop(Multihop.Params(routing="static"), link), 3)
    bench.send(0, "host_1", "host_3", 500)
    assert bench.run() == [(2 * (500 * US + MS), None, "host_1", "host_3", "arrived")]
    assert bench.medium.model.reasons == ("queue_full", "relay_queue_full", "hop_limit", "no_path",
                                          "relay_down", "relay_no_path")


# ------------------------------------------------------------------------------------ static paths


def test_etx_prefers_two_good_hops_to_a_bad_one():
    """11a at 24 Mb/s: 48 m are got over by 45 % of the packets, half of it by all."""
    places = {"a": (0, 0), "b": (24, 0), "c": (48, 0)}
    for metric, next_hop in ("etx", 1), ("hops", 2):
        bench = Bench(multihop(hop="radio", static={"metric": metric, "usable": "30 %"},
                               standard="11a", rate="24 Mb/s"), places)
        assert bench.medium.model.routing.next_hop(0, 2) == next_hop


def test_links_of_the_radio_deliver_what_they_say():
    places = {"a": (0, 0), "b": (47, 0), "c": (20, 0)}
    radio = DcfRadio(DcfRadio.Params(standard="11a", rate="24 Mb/s", broadcast_rate="24 Mb/s"))
    bench = Bench(radio, places)
    one, other, delivery = radio.links()
    said = dict(zip(zip(one.tolist(), other.tolist(), strict=True), delivery, strict=True))
    for k in range(1000):
        bench.send(k * 2 * MS, "a", ["b", "c"], 1518, broadcast=True)
    arrived = Counter(receiver for *_, receiver, fate in bench.run() if fate == "arrived")
    assert said[0, 2] == pytest.approx(1) and arrived["c"] == 1000
    assert 0.3 < said[0, 1] < 0.9
    assert arrived["b"] / 1000 == pytest.approx(said[0, 1], abs=0.05)


def test_paths_are_made_anew_when_somebody_has_left_and_it_is_time():
    """A diamond: a, b above and c below, d."""
    places = {"a": (0, 0), "b": (9, 3), "c": (9, -3), "d": (18, 0)}
    model = multihop(static={"update": "1 s"})
    bench = Bench(model, places)
    routing, seen = model.routing, []
    for ms in (500, 1500, 2500):
        bench.kernel.at(ms * MS, 0, 0, lambda _: seen.append(routing.next_hop(0, 3)))
    bench.kernel.at(1600 * MS, 0, 0, lambda _: model.switched(1, False))
    bench.run(3 * S)
    assert seen == [1, 1, 2]


def test_static_paths_may_stay_as_they_are_without_updates():
    model = multihop(static={"update": None})
    Bench(model, row(3))
    assert model.routing.next_hop(0, 2) == 1
    model.switched(1, False)
    assert model.routing.next_hop(0, 2) == 1
    model.routing.recompute()
    assert model.routing.next_hop(0, 2) is None


# ---------------------------------------------------------------------------------------- batman


def test_a_link_is_as_good_as_its_echoes():
    link = LinkQuality(window=64)
    assert link.quality(0) == 0
    for number in range(1, 9):
        link.heard(number)
    assert link.quality(8) == 0  # it does not hear us
    for number in (1, 3, 5, 7):
        link.echoed(number)
    assert link.quality(8) == 4 / 8
    link.heard(10)  # 9 was lost
    assert link.quality(10) == pytest.approx(4 / 9 * (1 - (1 - 9 / 10) ** 3))
    assert link.quality(64 + 8) == 0  # long ago


def test_the_way_that_is_heard_more_of_is_the_better_one():
    ways = Routes(memory=5)
    for number in (1, 2, 3):
        assert ways.hear(7, number, 0.9, 0)
        assert not ways.hear(8, number, 0.9, 0)  # equal
    for number, best in (4, 7), (5, 8):
        ways.hear(8, number, 0.9, 0)
        assert ways.best == best
    assert not ways.hear(7, 0, 0.9, 0)  # older than what is remembered


def test_everybody_finds_the_way_to_everybody():
    model = multihop("batman")
    Bench(model, row(6), seed=2).run(6 * S)
    assert [[model.routing.next_hop(host, dest) for dest in range(6) if dest != host]
            for host in range(6)] == [
        [host - 1 if dest < host else host + 1 for dest in range(6) if dest != host]
        for host in range(6)]


def test_an_isolated_host_speaks_once_a_second():
    model = multihop("batman")
    Bench(model, {"a": (0, 0), "b": (100, 0)}).run(100 * S)
    frames, size_bytes = model.control()
    assert 2 * 98 <= frames <= 2 * 102 and size_bytes == 42 * frames


def sent(places, until_s, **batman):
    """Frames and messages of a second without losses, after twenty seconds."""
    model = multihop("batman", "disk", range="11 m", batman=batman)
    bench, counts = Bench(model, places, seed=1), []
    bench.book(20 * S, lambda _: counts.append(model.control()), None)
    bench.run(until_s * S)
    frames, size_bytes = (now - then for now, then in zip(model.control(), counts[0], strict=True))
    return tuple(count / (until_s - 20) for count in (frames, (size_bytes - 18 * frames) / 24))


GRID = {f"h{6 * y + x}": (10.0 * x, 10.0 * y) for x in range(6) for y in range(6)}


def most_frames(places):
    """Of a second: a host's own, its neighbours' one by one, and a bundle each 100 ms at most."""
    return sum(1 + sum(0 < abs(x - u) + abs(y - v) <= 11 for u, v in places.values()) + 10
               for x, y in places.values())


def test_a_grid_passes_every_message_on_once_and_in_bundles():
    frames, messages = sent(GRID, 30, jitter="0 s")
    assert messages == pytest.approx(len(GRID) ** 2, rel=0.01)
    assert frames < most_frames(GRID) < 0.5 * messages


def test_twin_grid_whose_messages_do_not_wait():
    frames, messages = sent(GRID, 30, jitter="0 s", wait="0 s")
    assert frames == messages > most_frames(GRID)


def test_what_comes_straight_from_its_originator_leaves_alone():
    """All are neighbours: n^2 frames of one message."""
    places = {f"h{k}": (float(k), 0.0) for k in range(8)}
    frames, messages = sent(places, 30, jitter="0 s")
    assert frames == messages == 8 ** 2


@pytest.mark.parametrize(("due_ms", "most", "joins"), [
    (99, 2, False), (100, 2, True), (199, 2, True), (200, 2, False), (150, 1, False)])
def test_a_message_joins_a_frame_that_leaves_soon_and_has_room(due_ms, most, joins):
    assert Bundle(200 * MS, None, most).takes(due_ms * MS, 100 * MS) == joins


def recovery(leaves_s=15, **batman):
    """From a to d through b, or with one hop more through c and e. Of 10 frames a second from 5 s
    on, and b leaves: the log, when what was lost, and the model."""
    places = {"a": (0, 0), "b": (9, 3), "c": (3, -9), "d": (18, 0), "e": (12, -9)}
    model = multihop("batman", batman=batman)
    bench = Bench(model, places, seed=1)
    for k in range(10 * leaves_s + 200):
        bench.send(5 * S + k * 100 * MS, "a", "d", 500, label=k)
    bench.kernel.at(leaves_s * S, 0, 0, lambda _: model.switched(1, False))
    log = bench.run((leaves_s + 30) * S)
    return log, [time_ns / S for time_ns, *_, fate in log if fate != "arrived"], model


def test_routes_are_repaired_when_a_host_leaves():
    """Within three messages' intervals, with jitter, by what was heard only."""
    log, lost_s, model = recovery()
    assert lost_s and min(lost_s) >= 15 and max(lost_s) <= 15 + 3 * 1.02
    assert {fate for *_, fate in log} == {"arrived", "out_of_range"}
    assert model.routing.next_hop(0, 3) == 2


def test_twin_repair_takes_longer_with_a_longer_memory():
    _, lost_s, _ = recovery(leaves_s=75, memory=64)
    assert max(lost_s) > 75 + 3 * 1.02


def test_without_messages_nothing_is_known():
    log, _, model = recovery(interval="1000 s")
    assert {fate for *_, fate in log} == {"no_path"} and model.control()[0] <= 2


def test_a_host_that_is_not_heard_any_more_is_forgotten():
    model = multihop("batman", batman={"purge": "10 s"})
    bench = Bench(model, row(3))
    seen = {}
    for s in (8, 19, 31):
        bench.kernel.at(s * S, 0, 0, lambda _: seen.update(
            {bench.kernel.now_ns // S: model.routing.next_hop(0, 2)}))
    bench.kernel.at(20 * S, 0, 0, lambda _: model.switched(2, False))
    bench.run(40 * S)
    assert seen == {8: 1, 19: 1, 31: None}


# ------------------------------------------------------------------------------------- the chains


def share(hops, mac, **params):
    return play(RelayChain(RelayChain.Params(**{
        "hops": hops, "mac": mac, "duration": "5 s", **params})).setup())


def bound(hops):
    return 1 / min(hops, 4)


@pytest.mark.parametrize("mac", ["ideal", "tdma"])
@pytest.mark.parametrize("hops", [3, 8, *(
    pytest.param(hops, marks=pytest.mark.validation) for hops in (2, 4, 5, 12))])
def test_a_chain_carries_one_by_hops_then_a_quarter(mac, hops):
    assert share(hops, mac, duration="2 s")["goodput_share"] == pytest.approx(
        bound(hops), rel=0.005)


@pytest.mark.parametrize("mac", ["ideal", "tdma"])
def test_twin_chain_where_a_frame_hinders_up_to_one_hop_only(mac, monkeypatch):
    """Interference of 1.9 instead of 2.1 hops: 10 %."""
    monkeypatch.setattr(chain, "INTERFERENCE", 0.905 * chain.INTERFERENCE)
    monkeypatch.setattr(chain, "_REUSE", 3)
    assert share(8, mac)["goodput_share"] != pytest.approx(bound(8), rel=0.005)


def test_a_slot_that_every_third_host_shares_is_too_often(monkeypatch):
    monkeypatch.setattr(chain, "_REUSE", 3)
    found = share(8, "tdma")
    assert found["lost"]["collision"] > 1000 and found["goodput_share"] < 0.2


@pytest.mark.parametrize("hops", [6, 8])
def test_under_dcf_a_chain_carries_between_an_eighth_and_a_quarter(hops):
    assert 1 / 8 <= share(hops, "dcf")["goodput_share"] <= 1 / 4


def test_twin_chain_under_dcf_whose_hosts_hear_one_hop_only():
    """5 % farther apart: beyond two hops nobody is heard, and every other frame is corrupted."""
    assert not 1 / 8 <= share(8, "dcf", spacing="26.25 m")["goodput_share"] <= 1 / 4


@pytest.mark.parametrize(("rate", "spacing", "hops"), [
    ("6 Mb/s", "25 m", 3), ("6 Mb/s", "30 m", 6), ("12 Mb/s", "30 m", 6)])
def test_slow_rates_survive_a_sender_three_hops_away(rate, spacing, hops):
    """9 dB weaker than theirs: every third hop may be in use, and they carry more than 24 Mb/s do
    (0.165). Over 25 m twice they skip a host."""
    found = share(6, "dcf", rate=rate, spacing=spacing)
    assert share(6, "dcf")["goodput_share"] < found["goodput_share"] < 1 / 3
    succeeded = found["attempts"] * (1 - found["failure_rate"])
    assert succeeded / found["delivered"] == pytest.approx(hops, rel=0.05)


def test_a_chain_may_be_as_long_as_it_likes():
    assert share(60, "ideal", duration="2 s")["goodput_share"] == pytest.approx(1 / 4, rel=0.005)


def test_the_spacing_changes_nothing_where_only_hops_count():
    assert share(3, "ideal", spacing="3 m", duration="2 s") == share(3, "ideal", duration="2 s")


@pytest.mark.parametrize("mac", ["dcf", *(
    pytest.param(mac, marks=pytest.mark.validation)  # which `desim validate` repairs, too
    for mac in ("ideal", "tdma"))])
def test_after_a_host_has_left_a_chain_recovers(mac):
    """The host in the middle leaves after 3 s, of 2 s + 20 s: half is carried of what the chain
    carries with it."""
    found = play(RelayChain(RelayChain.Params(hops=4, mac=mac, routing="batman", leave="3 s",
                                    duration="20 s")).setup())
    intact = share(4, mac, routing="batman")
    assert found["control_frames"] > 100
    if mac == "dcf":  # messages as long as packets are not bundled
        assert found["control_bytes"] == found["control_frames"] * 1046
    assert found["goodput_share"] > 0.5 * intact["goodput_share"]
    assert sum(found["lost"].values()) > 0


@pytest.mark.parametrize("params", [
    {"hops": 1}, {"hops": 2, "mac": "tdma", "routing": "batman", "leave": "200 ms"},
    {"hops": 3, "mac": "dcf"}])
def test_the_case_keeps_the_contract(params):
    check_case(RelayChain, duration="200 ms", **params)


# ----------------------------------------------------------------------------------------- the macs


def test_hosts_that_do_not_hinder_each_other_send_at_once():
    """Five in a row: 0 to 1 and 3 to 4 share a neighbour of a receiver; far pairs do not."""
    bench = Bench(IdealMac(IdealMac.Params(**NEAR)), row(6))
    for source, receiver in ("h0", "h1"), ("h3", "h2"), ("h4", "h5"):
        bench.send(0, source, receiver, 1000, label=source)
    assert sorted((time_ns // US, label) for time_ns, label, *_ in bench.run()) == [
        (1000, "h0"), (1000, "h4"), (2000, "h3")]


def test_whoever_was_silent_for_longest_goes_first():
    bench = Bench(IdealMac(IdealMac.Params(**NEAR)), row(3))
    for label in range(3):
        bench.send(0, "h0", "h1", 1000, label=label)
    bench.send(100 * US, "h2", "h1", 1000, label="other")
    assert [label for _, label, *_ in bench.run()] == [0, "other", 1, 2]


def test_frames_in_one_slot_spoil_each_other_at_whoever_hears_both():
    slots = {"h0": 0, "h2": 0, "h3": 1}
    bench = Bench(Tdma(Tdma.Params(slots=slots, cycle=2, slot="1 ms", **NEAR)), row(5))
    bench.send(0, "h0", "h1", 1000)
    bench.send(0, "h2", ["h1", "h3", "h4"], 1000, broadcast=True)
    bench.send(0, "h3", "h4", 1000)
    assert sorted(bench.run()) == [
        (MS, None, "h0", "h1", "collision"), (MS, None, "h2", "h1", "collision"),
        (MS, None, "h2", "h3", "arrived"), (MS, None, "h2", "h4", "out_of_reach"),
        (2 * MS, None, "h3", "h4", "arrived")]


def test_a_train_takes_a_slot_a_packet():
    bench = Bench(Tdma(Tdma.Params(cycle=3, slot="1 ms", **NEAR)), row(2))
    bench.send(0, "h1", "h0", 3000, segments=3, label="train")
    bench.send(0, "h0", "h1", 1001, label="long")
    assert bench.run() == [(0, "long", "h0", "h1", "too_long"),
                           ((1 + 3 * 2 + 1) * MS, "train", "h1", "h0", "arrived")]
    assert airtime_ns(1000, 8_000_000) == MS


# ------------------------------------------------------------------------------------ wrong input


@pytest.mark.parametrize(("data", "line"), [
    ({"hop": "disk", "radio": {"rate": "6 Mb/s"}},
     "radio is given, but hop is disk: its parameters stand under disk"),
    ({"hop": "wifi"}, "'wifi' is not allowed; allowed: radio, disk, ideal_mac, tdma"),
    ({"hop": "tdma", "tdma": {"slots_": {}}},
     "unknown key (did you mean 'slots'?); allowed: rate, slot, cycle, slots, range, "
     "interference, queue"),
    ({"hop": "ideal_mac", "ideal_mac": {"interference": "100 m"}},
     "interference (100 m) is less than range (200 m); who is near enough to get a frame is near "
     "enough to be disturbed"),
    ({"hop_limit": 0}, "must be at least 1, got 0"),
])
def test_wrong_parameters_are_said_at_their_place(data, line):
    (complaint,) = validated(Multihop.Params, data)
    assert complaint.text == line


@pytest.mark.parametrize(("slots", "line"), [
    ({"h": 0}, ".slots: no host 'h' (did you mean 'h1'?)"),
    ({"h0": 4}, ".slots.h0: 4 is no slot; allowed: 0 to 3"),
])
def test_slots_are_those_of_the_hosts(slots, line):
    with pytest.raises(InputError) as error:
        Bench(Tdma(Tdma.Params(cycle=4, slots=slots)), row(2))
    assert str(error.value) == line


def test_what_is_wrong_with_a_hop_is_said_under_its_name():
    with pytest.raises(InputError) as error:
        Bench(multihop("batman", "radio", rate="7 Mb/s"), row(2))
    assert str(error.value).startswith(".radio.rate: 7 Mb/s is no rate of 11g; allowed: 1 Mb/s, ")


def test_who_hears_a_message_gets_packets():
    """54 Mb/s: 40 m are two hops, though broadcasts at 6 Mb/s would get over them."""
    for params, next_hop in ({}, 1), ({"broadcast_rate": "6 Mb/s"}, 2):
        model = multihop("batman", "radio", **params, **LINKS)
        Bench(model, row(3, spacing_m=20.0)).run(6 * S)
        assert model.routing.next_hop(0, 2) == next_hop


def test_nobody_can_leave_a_single_hop():
    with pytest.raises(InputError) as error:
        RelayChain(RelayChain.Params(hops=1, leave="1 s")).setup()
    assert str(error.value) == ".leave: in a single hop there is no host in the middle"


def test_a_rung_is_built_from_the_parameters_of_the_radio():
    """Two hops of 40 m: each by itself is one of the radio's; 80 m are not."""
    radio = DcfRadio.Params(standard="11a", rate="6 Mb/s")
    bench = Bench(Multihop(Multihop.Params(), DcfRadio(radio)), row(3, spacing_m=40.0))
    bench.send(5 * S, "h0", "h2", 1046)
    assert [fate for *_, fate in bench.run(6 * S)] == ["arrived"]
    assert set(DcfRadio.reasons) < set(bench.medium.model.reasons)
