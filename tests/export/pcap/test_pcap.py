"""``desim export --pcap``: packets, sizes and times are those of the run; tshark agrees."""

from __future__ import annotations

import shutil
import struct
import subprocess

import pytest
from captures import Record, records
from typer.testing import CliRunner

import desim
from desim.cli import app
from desim.errors import InputError
from desim.export.pcap.capture import write_pcap
from desim.export.pcap.packet_headers import CapturedPacket, Segment, network_packet
from desim.network.taps import tap
from desim.results.run import Run
from desim.scenario.load import load
from desim.simulation.simulation import Simulation
from netmodels.radio.standards import psdu_bytes

ETHERNET, RADIOTAP = 1, 127
SHORT = ("stop.elapsed=6 s",)
FIELD = (*SHORT, "deployment=field", "network.media.air={model: radio}", "middleware.model=ros1")


def never(part: int, whole: int) -> None:
    """Progress that nobody looks at."""


def never_mind(frame: object, carrier: object, token: object) -> None:
    """A tap at which nobody listens."""


@pytest.fixture(scope="module")
def hello(repository, tmp_path_factory):
    return desim.run(repository / "scenarios" / "hello.yaml", overrides=SHORT,
                     out=tmp_path_factory.mktemp("results"))


@pytest.fixture(scope="module")
def field(repository, tmp_path_factory):
    return desim.run(repository / "scenarios" / "hello.yaml", overrides=FIELD,
                     out=tmp_path_factory.mktemp("results"))


@pytest.fixture(scope="module")
def wired(hello, tmp_path_factory):
    path = tmp_path_factory.mktemp("pcap") / "lan.pcap"
    write_pcap(hello, "lan", path, never)
    return path


@pytest.fixture(scope="module")
def radio(field, tmp_path_factory):
    path = tmp_path_factory.mktemp("pcap") / "wifi.pcap"
    (medium,) = field.scenario.network.media
    write_pcap(field, medium, path, never)
    return path


def test_packets_and_bytes_are_those_of_the_medium(hello, wired):
    link, packets = records(wired)
    simulation = Simulation(load(hello.file("scenario.resolved.yaml")).scenario)
    outcome = simulation.run()
    (medium,) = simulation.graph.media
    assert outcome.digest == hello.manifest["digest"]
    assert link & 0xFFFF == ETHERNET and link >> 28 == 2  # words of the check sequence
    assert len(packets) == medium.packets_intended  # there is no broadcast
    assert sum(packet.length for packet in packets) == hello.metrics["bytes_on_air"]
    assert max(packet.length for packet in packets) == 1518
    times_ns = [packet.time_ns for packet in packets]
    assert times_ns == sorted(times_ns)


def test_a_tap_changes_nothing(field, hello):
    for run in (hello, field):
        simulation = Simulation(load(run.file("scenario.resolved.yaml")).scenario)
        (medium,) = simulation.graph.media
        tap(medium, never_mind)
        assert simulation.run().digest == run.manifest["digest"]


def test_each_message_sets_out_when_the_run_says(hello, wired):
    packets = records(wired)[1]
    times_ns = {packet.time_ns for packet in packets}
    messages = hello.table("messages")
    sent = messages["first_ns"][messages["first_ns"] >= 0]
    assert len(sent) > 500
    assert set(sent.astype(int).tolist()) <= times_ns
    assert not {time_ns + 1 for time_ns in times_ns} & set(sent.astype(int).tolist())


def test_the_packets_of_a_train_follow_each_other_at_the_rate_of_the_medium(wired):
    full = [packet for packet in records(wired)[1] if packet.length == 1518]
    by_ports: dict[bytes, list[Record]] = {}
    for packet in full:
        by_ports.setdefault(packet.data[34:38], []).append(packet)
    train = next(flow for flow in by_ports.values() if len(flow) > 5)
    assert train[1].time_ns - train[0].time_ns == 1518 * 8  # 1 Gb/s
    first, second = (struct.unpack_from(">I", packet.data, 38)[0] for packet in train[:2])
    assert second - first == 1448


def test_addresses_say_which_host_it_is(hello, wired):
    hosts = {packet.data[6:12] for packet in records(wired)[1]}
    assert sorted(hosts) == [bytes([2, 0, 0, 0, 0, number]) for number in (1, 2, 3, 4)]


def test_a_radio_has_frames_of_80211(field, radio):
    link, packets = records(radio)
    assert link == RADIOTAP
    (length,) = {struct.unpack_from("<H", packet.data, 2)[0] for packet in packets}
    assert sum(packet.length - length - psdu_bytes(0, 1) for packet in packets) == \
        field.metrics["bytes_on_air"]
    assert all(packet.data[length] == 0x08 for packet in packets)  # data


def test_ports_are_those_of_source_and_destination_on_both_ways(radio):
    """Host, port, host, port of TCP packets; the lower port is where a conversation began."""
    ways = {}
    for packet in records(radio)[1]:
        head = packet.data[packet.data[2] + 24 + 8:]  # behind radiotap, 802.11, LLC and SNAP
        if packet.data[packet.data[2] + 30:][:2] == b"\x08\x00" and head[9] == 6:  # IPv4, TCP
            source_port, to_port = struct.unpack_from(">HH", head, 20)
            ways.setdefault((head[12:16], source_port, head[16:20], to_port), head[33])
    began = {way for way, flags in ways.items() if flags == 0x02}  # SYN
    answered = {way for way, flags in ways.items() if flags == 0x12}  # SYN and ACK
    assert len(began) > 5
    assert {(to, to_port, source, port) for source, port, to, to_port in began} == answered
    assert all(to_port == port + 1 for _, port, _, to_port in began)
    assert ways.keys() == began | answered


def test_an_acknowledgement_without_data_pushes_nothing(radio):
    """RFC 9293, 3.7.4: PSH marks data, and a segment without any acknowledges what came before."""
    acks = []
    for packet in records(radio)[1]:
        head = packet.data[packet.data[2] + 24 + 8:]
        if packet.data[packet.data[2] + 30:][:2] == b"\x08\x00" and head[9] == 6:
            data_bytes = struct.unpack_from(">H", head, 2)[0] - 20 - (head[32] >> 4) * 4
            if not data_bytes and head[33] not in (0x02, 0x12):  # no SYN
                acks.append((head[33], struct.unpack_from(">I", head, 28)[0]))
    assert {flags for flags, _ in acks} == {0x10}
    assert max(number for _, number in acks) > 1000


@pytest.mark.parametrize(("size_bytes", "ip_bytes", "udp_bytes"), [
    (1518, 1500, 1480), (47, 29, 9), (46, 28, 8), (20, 28, 8)])
def test_the_bytes_of_a_datagram(size_bytes, ip_bytes, udp_bytes):
    """Ethernet's header and check sequence take 18 B, IPv4's header 20 B (RFC 791) of what is left;
    UDP's length has its own header of 8 B (RFC 768)."""
    _, body = network_packet(CapturedPacket(0, 0, 1, False, size_bytes, "udp", (49152, 7400),
                                            Segment(0, 0, 0), 0))
    assert struct.unpack_from(">BBH", body) == (0x45, 0, ip_bytes)
    assert (body[9], body[12:16], body[16:20]) == (17, bytes([10, 0, 0, 1]), bytes([10, 0, 0, 2]))
    assert struct.unpack(">HHHH", body[20:]) == (49152, 7400, udp_bytes, 0)


def fields(path, *names: str) -> list[list[str]]:
    if shutil.which("tshark") is None:
        pytest.skip("tshark is not installed")
    done = subprocess.run(
        ["tshark", "-r", path, "-T", "fields", *(word for name in names for word in ("-e", name))],
        capture_output=True, text=True, check=True, timeout=120)
    return [line.split("\t") for line in done.stdout.splitlines()]


def agrees(path, packets: list[Record]) -> bool:
    """Whether tshark has read these packets: as many, as long, and at these times."""
    found = [(round(float(time) * 1e9), int(length))
             for time, length in fields(path, "frame.time_epoch", "frame.len")]
    return found == [(packet.time_ns, packet.length) for packet in packets]


@pytest.mark.parametrize("name", ["wired", "radio"])
def test_tshark_agrees(name, request):
    path = request.getfixturevalue(name)
    packets = records(path)[1]
    assert agrees(path, packets)
    late = packets[100]._replace(time_ns=packets[100].time_ns + 1)
    assert not agrees(path, [*packets[:100], late, *packets[101:]])


@pytest.mark.parametrize("name", ["wired", "radio"])
def test_tshark_finds_nothing_malformed(name, request):
    path = request.getfixturevalue(name)
    found = fields(path, "_ws.malformed", "ip.src", "tcp.len", "arp.opcode")
    assert not any(malformed for malformed, *_ in found)
    assert {source for _, source, _, _ in found if source} <= {f"10.0.0.{i}" for i in range(1, 5)}
    assert any(length and int(length) > 0 for _, _, length, _ in found)


def test_tshark_follows_the_numbers_of_tcp(radio):
    """Data of a connection is new unless it was repeated, and a SYN comes first."""
    flags = fields(radio, "tcp.stream", "tcp.flags.syn", "tcp.analysis.out_of_order",
                   "tcp.analysis.lost_segment")
    first = {}
    for stream, syn, disordered, lost in flags:
        if stream:
            first.setdefault(stream, syn)
            assert not disordered and not lost
    assert len(first) > 5 and set(first.values()) <= {"1", "True"}


def test_unknown_medium_is_refused(hello, tmp_path):
    with pytest.raises(InputError) as error:
        write_pcap(hello, "lam", tmp_path / "a.pcap", never)
    assert str(error.value) == (f"--medium: {hello.path} has no medium 'lam' (did you mean 'lan'?)"
                                "; allowed: lan")


def test_a_run_of_other_versions_is_refused(hello, tmp_path, monkeypatch):
    run = Run(hello.path)
    monkeypatch.setitem(run.manifest, "source", "0000")
    with pytest.raises(InputError) as error:
        write_pcap(run, "lan", tmp_path / "a.pcap", never)
    assert str(error.value) == (
        f"{hello.path}: its packets were not kept, and it cannot be repeated: source in its "
        "manifest differ from those installed now; run the scenario again")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("words, text", [
    ((), "nothing to export; allowed: "),
    (("--medium", "lan"), "--medium: it belongs to --pcap"),
    (("--pcap", "no/such/folder/a.pcap"),
     "--pcap: no/such/folder/a.pcap cannot be written: No such file or directory"),
])
def test_a_wrong_command_line_gets_one_line(hello, words, text):
    done = CliRunner().invoke(app, ["export", str(hello.path), *words])
    assert done.exit_code == 2
    assert done.stderr.strip().splitlines()[-1].startswith(text)


def test_the_command_names_file_and_packets(hello, tmp_path):
    done = CliRunner().invoke(app, ["export", str(hello.path), "--pcap", str(tmp_path / "a.pcap")])
    count = len(records(tmp_path / "a.pcap")[1])
    assert (done.exit_code, done.stdout) == (0, f"{tmp_path / 'a.pcap'}: {count} packets\n")
