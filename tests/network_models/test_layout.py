"""``desim net layout FILE``: hosts at given places with given flows."""

import json

import pytest
from typer.testing import CliRunner

from desim.cli import app
from desim.errors import InputError
from desim.netcases.case import play
from desim.netcases.setup_places import SetupPlaces
from desim.scenario import block_file, yaml12
from desim.scenario.complaints import validated
from desim.testing import check_case
from netmodels.cases.layout import Layout
from netmodels.cases.two_senders import TwoPairs
from netmodels.radio.radio import Radio

FLOWS = [{"from": 0, "to": 1}, {"from": 1, "via": [2, 3], "arrivals": "poisson", "period": "20 ms"},
         {"from": 2, "broadcast": True, "arrivals": "periodic", "period": "100 ms"}]


def net(*words):
    return CliRunner().invoke(app, ["net", "layout", *map(str, words)])


def test_a_layout_keeps_the_contract_of_cases():
    check_case(Layout, places=[[0, 0], [10, 0], [20, 0], [30, 0]], flows=FLOWS, duration="1 s")


@pytest.fixture
def file(tmp_path):
    def write(text: str) -> str:
        path = tmp_path / "there.yaml"
        path.write_text(text)
        return str(path)

    return write


def test_the_example_is_played_as_every_case(repository):
    result = net(repository / "scenarios" / "layouts" / "relay.yaml", "--json")
    found = json.loads(result.stdout)
    assert (result.exit_code, found["case"], found["seed"]) == (0, "layout", 1)
    assert found["settings"]["flows"][0]["via"] == [1, 2]
    assert 2 < found["goodput_mbps"] < 10 and found["frames"] > 1000
    hops = 2  # of the chain: two packets each, one of which is in its place
    assert found["lost"].keys() <= {"channel_error", "collision", "out_of_reach", "retry_limit"}
    assert found["attempts"] > hops * found["delivered"] / 4


def test_a_layout_of_two_pairs_is_the_case_of_that_name():
    """The same places, flows and luck by number: the same figures."""
    case = play(TwoPairs(TwoPairs.Params(duration="2 s")).setup(), seed=3)
    layout = play(Layout(Layout.Params(
        preset="ns3_3_44", rate="6 Mb/s", warm_up="500 ms", duration="2 s",
        places=[[0, 0], [10, 0], [0, 40], [10, 40]],
        flows=[{"from": 0, "to": 1}, {"from": 2, "to": 3}])).setup(), seed=3)
    assert layout["goodput_mbps"] == pytest.approx(case["goodput_mbps"], rel=0.03)


@pytest.mark.parametrize(("keys", "mbps"), [
    ({}, 58.4), ({"aggregation": False}, 24.8),
    ({"access_points": [{"at": ["0 m", "0 m"], "channel": 36}],
      "infrastructure": {"wired": ["host_0"]}}, 58.4)])
def test_saturated_flows_fill_aggregates(keys, mbps):
    """ns-3's goodput of one station: 41 packets in an aggregate, or each by itself. A standard that
    has an ``mcs`` needs no ``rate``."""
    layout = Layout(Layout.Params(
        standard="11n", mcs=7, channel=36, preset="ns3_3_44",
        path_loss={"model": "fixed", "total": "66 dB"}, places=[[0, 0], [1, 0]],
        flows=[{"from": 0, "to": 1}], duration="1 s", **keys))
    assert play(layout.setup())["goodput_mbps"] == pytest.approx(mbps, rel=0.03)


def test_what_is_relayed_crosses_each_hop_once():
    """100 packets a second over two hops: as many arrive, and each is sent twice."""
    found = play(Layout(Layout.Params(
        rate="24 Mb/s", places=[[0, 0], [25, 0], [50, 0]],
        flows=[{"from": 0, "via": [1], "to": 2, "arrivals": "periodic", "period": "10 ms"}],
    )).setup())
    assert (found["frames"], found["delivered"], found["attempts"]) == (1000, 1000, 2000)
    assert found["delay_mean_ms"] > 2 * 0.376


HEAD = "places: [[0, 0], [10, 0]]\nflows:\n"


@pytest.mark.parametrize(("text", "says"), [
    (HEAD + "- {from: 0, to: 2}\n", "{file}:3:17: flows.0.to: there is no host 2; allowed: 0 to 1"),
    (HEAD + "- {from: 0}\n",
     "{file}:3:3: flows.0: nobody receives it; allowed: to, via or broadcast: true"),
    (HEAD + "- {from: 0, to: 0}\n", "{file}:3:3: flows.0: it comes to a host twice: 0, 0"),
    (HEAD + "- {from: 0, to: 1, arrivals: poisson}\n",
     "{file}:3:30: flows.0.arrivals: poisson packets need a period, e.g. period: 20 ms"),
    (HEAD + "- {from: 0, broadcast: true}\n",
     "{file}:3:3: flows.0.arrivals: broadcasts have a period; allowed: periodic, poisson"),
    (HEAD + "- {from: 0, to: 1, period: 1 s}\n",
     "{file}:3:28: flows.0.period: a saturated flow has none; allowed: arrivals: periodic, "
     "poisson"),
    (HEAD + "- {from: 0, to: 1}\nrate: 13 Mb/s\n",
     "{file}:4:7: rate: 13 Mb/s is no rate of 11a; allowed: 6 Mb/s, 9 Mb/s, 12 Mb/s, 18 Mb/s, "
     "24 Mb/s, 36 Mb/s, 48 Mb/s, 54 Mb/s"),
    (HEAD + "- {frm: 0, to: 1}\n", "{file}:3:4: flows.0.frm: unknown key (did you mean 'from'?); "
     "allowed: from, to, via, broadcast, protocol, payload, arrivals, period"),
    ("places: [[0, 0], [1e9, 0]]\nflows: [{from: 0, to: 1}]\n",
     "{file}:1:18: places.1: allowed: -1e+06 to 1e+06 m"),
    ("flows: [{from: 0, to: 1}]\n",
     "{file}:1:1: the key 'places' is missing: of the hosts, [x, y] in m"),
])
def test_what_is_wrong_has_a_place(file, text, says):
    path = file(text)
    result = net(path)
    assert (result.exit_code, result.stderr.strip()) == (2, says.format(file=path))


@pytest.mark.parametrize(("words", "says"), [
    ((), "FILE is missing"), (("a.yaml", "b.yaml"), "is not one file"),
    (("--rate", "5"), "is not one file"), (("nowhere.yaml",), "nowhere.yaml: no such file"),
])
def test_wrong_words(words, says):
    result = net(*words)
    assert result.exit_code == 2 and says in result.stderr


def test_the_help_lists_the_keys_of_the_file():
    said = net("--help").stdout
    assert all(key in said for key in ("flows[].via", "broadcast_rate", "places", "--seed"))
    assert "the number of the host that sends, from 0" in said  # not its name, which is refused
    assert "default false" in said and "default no" not in said


# ---------------------------------------------------------------------------- the radio's own keys


def test_every_key_of_the_radio_is_one_of_a_layout(file):
    """Each with the radio's own default; a layout's own standard and rate stand for themselves."""
    radio = Radio.Params().model_dump(mode="json", by_alias=True)
    for key, value in radio.items():
        path = file(yaml12.dump({key: value, "standard": "11g", "rate": "54 Mb/s", "places": PAIR,
                                 "flows": [{"from": 0, "to": 1}]} | {key: value}))
        found = block_file.read(path, Layout.Params).params.model_dump(mode="json", by_alias=True)
        assert {name: found[name] for name in radio} == radio, key
    assert issubclass(Layout.Params, Radio.Params)  # so that a key that comes later is one at once


PAIR = [[0.0, 0.0], [10.0, 0.0]]


def one_flow(**keys):
    found = play(Layout(validated(Layout.Params, {
        "places": PAIR, "duration": "2 s", "warm_up": "100 ms",
        "flows": [{"from": 0, "to": 1}], **keys})).setup())
    return found["goodput_mbps"], found["attempts"]


@pytest.mark.parametrize("preset", ["indoor", "outdoor", "ns3_3_44"])
def test_presets_know_the_standard_of_a_layout(preset):
    assert one_flow(preset=preset) == one_flow(preset=preset, standard="11a")


def test_rts_is_true_or_false_or_a_size():
    asked, free = one_flow(rts=True), one_flow(rts=False)
    assert asked == one_flow(rts="0 B") != free == one_flow(rts=None)


@pytest.mark.parametrize(("keys", "differs"), [
    ({"rate_control": {"model": "arf"}}, True), ({"fading": {}}, True),
    ({"path_loss": {"exponent": 4}}, True), ({"channels": {"host_1": 40}}, True),
    ({"shadowing": {"sigma": "9 dB", "echoes": "12 dB"}}, True), ({"fidelity": "disk"}, True),
    ({"basic_rates": ["6 Mb/s"]}, True), ({"queue": 400}, False),
])
def test_parameters_of_the_radio_have_an_effect(keys, differs):
    plain = {"places": [[0.0, 0.0], [57.0, 0.0]]}
    assert (one_flow(**plain, **keys) != one_flow(**plain)) == differs


# ------------------------------------------------------------------------- walls, motion, antennas

OPEN = {"exponent": 3}  # given, so that it is the same beside walls


def wall(material, **keys):
    return {"from": ["5 m", "-9 m"], "to": ["5 m", "9 m"], "material": material, **keys}


def test_a_wall_costs_what_its_material_does():
    """Behind brick (9 dB) it is as with 9 dB less power; two walls cost twice."""
    far = {"places": [[0.0, 0.0], [55.0, 0.0]], "path_loss": OPEN, "power": "20 dBm"}
    weak, plain = one_flow(**far | {"power": "11 dBm"}), one_flow(**far)
    assert one_flow(**far, terrain={"walls": [wall("brick")]}) == weak != plain
    assert one_flow(**far, terrain={"walls": [wall("wood"), {
        **wall("wood"), "from": ["6 m", "-9 m"], "to": ["6 m", "9 m"]}]},
        walls={"crossing": {"wood": "4.5 dB"}}) == weak
    assert one_flow(**far, terrain={"walls": [wall("brick")]}, walls=None) == plain


def test_antennas_see_over_walls():
    low = {"places": [[0.0, 0.0], [27.0, 0.0]], "path_loss": OPEN,
           "terrain": {"walls": [wall("metal")]}}
    high = {f"host_{k}": {"height": "3 m"} for k in (0, 1)}
    assert one_flow(**low)[0] == 0 < one_flow(**low, antennas=high)[0]


@pytest.mark.parametrize("way", [[["10 s", 100, 0]],
                                 [["0 s", 0, 0], ["5 s", 50, 0], ["10 s", 100, 0]]])
def test_a_host_moves_from_its_place_to_its_way_points(way):
    """At 10 m/s it is within a disk's range for as long as that takes, to a step of 100 ms and a
    period of 10 ms. The twin stands."""
    keys = {"places": [[0.0, 0.0], [0.0, 0.0]], "fidelity": "disk", "warm_up": "1 ns", "flows": [
        {"from": 0, "to": 1, "arrivals": "periodic", "period": "10 ms"}]}
    params = validated(Layout.Params, {**keys, "motion": {"host_1": way}})
    range_m, _ = Radio.build(params).range_m
    moved, stood = (play(Layout(block).setup())
                    for block in (params, validated(Layout.Params, keys)))
    assert 20 < range_m < 90
    assert moved["delivered"] / 100 == pytest.approx(range_m / 10, abs=0.11)
    assert moved["lost"] == {"out_of_range": moved["frames"] - moved["delivered"]}
    assert stood["delivered"] == stood["frames"] == moved["frames"]


def test_it_stays_at_its_last_way_point():
    setup = Layout(validated(Layout.Params, {
        "places": [[0.0, 0.0], [4.0, 0.0]], "flows": [{"from": 0, "to": 1}],
        "motion": {"host_1": [["2 s", 0, 0], ["3 s", 0, 7]]}})).setup()
    site = SetupPlaces(setup, ("host_0", "host_1"))
    assert [site.positions(round(s * 1e9)).tolist() for s in (0, 1, 2, 2.5, 3, 99)] == [
        [[0, 0], [4, 0]], [[0, 0], [2, 0]], [[0, 0], [0, 0]], [[0, 0], [0, 3.5]],
        [[0, 0], [0, 7]], [[0, 0], [0, 7]]]


# ------------------------------------------------------------------------------------------- TCP


def tcp(**keys):
    flow = {"from": 0, "to": 1, "protocol": "tcp", **keys.pop("flow", {})}
    return play(Layout(validated(Layout.Params, {
        "places": PAIR, "flows": [flow], **keys})).setup())


def test_tcp_over_the_radio_carries_what_the_air_leaves_to_it():
    """Two segments of 1448 B and one acknowledgement take their airtimes (802.11a at 12 Mb/s), and
    DIFS and a backoff of 7.5 slots each. Two stations that contend collide now and then, and single
    segments are acknowledged, too. The twin, at 24 Mb/s, is above that."""
    def air_us(bytes_, rate_mbps=12):  # preamble, service and tail bits, symbols of 4 us
        return 20 + 4 * -(-(22 + 8 * bytes_) // (4 * rate_mbps))

    def cycle_us(ip_bytes):  # with LLC, MAC header and FCS; SIFS and acknowledgement
        return 34 + 7.5 * 9 + air_us(ip_bytes + 8 + 24 + 4) + 16 + air_us(14)

    most_mbps = 2 * 1448 * 8 / (2 * cycle_us(1448 + 52) + cycle_us(52))
    assert 0.85 * most_mbps < tcp(flow={"payload": "14480 B"})["goodput_mbps"] < most_mbps
    assert tcp(rate="24 Mb/s")["goodput_mbps"] > 1.3 * most_mbps


def test_messages_over_tcp_arrive_though_packets_are_lost():
    """At the edge some of what is sent is lost, and with one attempt UDP loses that;
    TCP sends it again. Its delay is from the write on."""
    edge = {"places": [[0.0, 0.0], [52.0, 0.0]], "retries": 1, "power": "11.3 dBm"}
    flow = {"payload": "1000 B", "arrivals": "periodic", "period": "100 ms"}
    lossy, udp = tcp(**edge, flow=flow), tcp(**edge, flow=flow | {"protocol": "udp"})
    assert udp["loss"] > 0.02
    assert lossy["lost"] == {} and 95 <= lossy["delivered"] <= 100 == lossy["frames"]
    assert lossy["delay_p95_ms"] > 2 * udp["delay_p95_ms"]


def test_a_connection_that_cannot_be_has_its_reason_and_is_tried_again():
    """Nobody is there for 140 s: the SYN gives up after 131 s, and the next one finds the host."""
    found = tcp(places=[[0.0, 0.0], [1000.0, 0.0]], duration="150 s", warm_up="1 ns",
                flow={"arrivals": "periodic", "period": "10 s"},
                motion={"host_1": [["132 s", 1000, 0], ["140 s", 10, 0]]})
    assert found["lost"] == {"timeout": 14}
    assert found["delivered"] in (1, 2)


def test_a_socket_that_is_full_takes_nothing():
    """Measured from 20 s on: before, TCP makes good what its slow start lost in the queue."""
    found = tcp(rate="6 Mb/s", warm_up="20 s", duration="20 s",
                flow={"payload": "100 kB", "arrivals": "periodic", "period": "10 ms"})
    assert found["lost"].keys() == {"queue_full"} and found["offered_mbps"] == pytest.approx(80)
    assert 4 < found["goodput_mbps"] < 5


@pytest.mark.parametrize(("text", "says"), [
    (HEAD + "- {from: 0, to: 1, protocol: tcp, via: [1]}\n",
     "{file}:3:40: flows.0.via: TCP goes from one host to another one; allowed: protocol: udp, or "
     "fidelity: multihop, in which hosts relay"),
    (HEAD + "- {from: 0, to: 1}\nfidelity: ideal\n",
     "{file}:3:3: flows.0.arrivals: where all arrives at once a saturated flow has no end; "
     "allowed: periodic, poisson"),
    (HEAD + "- {from: 0, to: 1, payload: 9 kB}\n",
     "{file}:3:29: flows.0.payload: a packet of UDP has at most 2268 B, got 9000 B; allowed: less, "
     "or protocol: tcp"),
    (HEAD + "- {from: 0, to: 1}\nterrain: {walls: [{from: [1 m, 0 m], to: [1 m, 9 m], "
            "material: bricks}]}\n",
     "{file}:4:64: terrain.walls.0.material: unknown material 'bricks' (did you mean 'brick'?); "
     "allowed: brick, concrete, glass, metal, plasterboard, stone, wood"),
    (HEAD + "- {from: 0, to: 1}\nmotion: {host_7: [[1 s, 0, 0]]}\n",
     "{file}:4:9: motion: no host 'host_7' (did you mean 'host_1'?); hosts are host_0, host_1"),
    (HEAD + "- {from: 0, to: 1}\nmotion: {host_1: [[9 s, 0, 0], [9 s, 5, 0]]}\n",
     "{file}:4:33: motion.host_1.1.0: a way point's time must be later than 9 s, that of the one "
     "before (0 s: of its place), got 9 s"),
    (HEAD + "- {from: 0, to: 1}\nmotion: {host_1: [[1 s, 2e6, 0]]}\n",
     "{file}:4:19: motion.host_1.0: allowed: -1e+06 to 1e+06 m"),
    (HEAD + "- {from: 0, to: 1}\nfadings: rayleigh\n",
     "{file}:4:1: fadings: unknown key (did you mean 'fading'?); allowed: standard"),
])
def test_what_is_wrong_with_walls_ways_and_tcp_has_a_place(file, text, says):
    path = file(text)
    result = net(path)
    assert result.exit_code == 2
    assert result.stderr.strip().startswith(says.format(file=path)), result.stderr


def test_a_saturated_flow_goes_on_when_its_station_has_joined():
    """Its first packets are refused, before the station has found the access point."""
    found = play(Layout(Layout.Params(
        standard="11n", places=[[5, 0], [0, 20]],
        access_points=[{"at": ["0 m", "0 m"], "channel": 36}],
        infrastructure={"wired": ["host_1"], "associated": False},
        flows=[{"from": 0, "to": 1}], duration="6 s")).setup())
    assert found["lost"]["not_associated"] > 0 and found["goodput_mbps"] > 20


POINT = [{"at": ["0 m", "0 m"], "channel": 36}]


@pytest.mark.parametrize(("given", "complaint"), [
    ({"access_points": POINT, "channel": 44},
     ".channel: it has no effect, because stations take the channels of their access points; "
     "allowed: without it"),
    ({"access_points": POINT, "infrastructure": {"queue": "fifo", "fq_codel": {"target": "9 ms"}}},
     ".infrastructure.fq_codel: it has no effect, because queue is fifo; allowed: without it"),
    ({"infrastructure": {"querier": False}},
     ".infrastructure: it has no effect, because there are no access_points; allowed: without it"),
    ({"access_points": POINT, "infrastructure": {"membership": "9 s"}},
     ".infrastructure.membership: it has no effect, because memberships end only with multicast: "
     "snooping and without a querier; allowed: without it")])
def test_no_key_of_a_layout_is_ignored(given, complaint):
    """A scenario warns of it; a layout has nobody to warn."""
    with pytest.raises(InputError) as caught:
        Layout(Layout.Params.model_validate({
            "places": [[0, 0], [9, 0]], "flows": [{"from": 0, "to": 1}], **given})).setup()
    assert str(caught.value) == complaint
