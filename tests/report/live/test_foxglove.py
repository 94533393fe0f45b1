"""A run that Foxglove watches while it goes on: the messages are those of the export."""

from __future__ import annotations

import base64
import socket
from contextlib import contextmanager
from itertools import count

import pytest

import desim
from desim.api import recording_of
from desim.engine.kernel import Phase
from desim.report.live.feed import LiveFeed, ViewersTime
from desim.report.live.stretch import Stretches

foxglove = pytest.importorskip("foxglove")
pytest.importorskip("rosbags")

from desim.export.ros.laser_scans import Scanner  # noqa: E402
from desim.export.ros.message_types import RosTypes  # noqa: E402
from desim.export.ros.topics import topic_messages  # noqa: E402
from desim.report.live.foxglove import Channels, foxglove_served  # noqa: E402


@pytest.fixture(scope="module")
def watched(tmp_path_factory, repository):
    """A run of hello, 12 s, and what its stretches say on each topic: times and bytes."""
    scenario, types, found = desim.load(repository / "scenarios" / "hello.yaml",
                                        ["stop.elapsed=12 s"]).scenario, RosTypes(2), {}
    scanner = Scanner(scenario)

    def note(stretch):
        for sample in topic_messages(stretch, types, scanner):
            found.setdefault(sample.topic, []).append(
                (sample.time_ns, types.data(sample.kind, sample.message)))

    @contextmanager
    def watch(simulation, folder):
        feed = LiveFeed(Stretches(simulation, folder, folder.recorder), [note],
                        clock=ViewersTime(now_s=count(0.0, 0.2).__next__))
        simulation.kernel.ticker(1, Phase.OBSERVE, (1 << 64) - 1, feed.sample)
        yield
        feed.end()

    return desim.run(scenario, out=tmp_path_factory.mktemp("live"), watch=watch), found


@pytest.mark.parametrize("topic", ["/tf", "/robot_0/odom", "/robot_2/scan", "/robot_1/plan",
                                   "/robot_1/goal", "/explored"])
def test_what_moves_is_as_in_the_export(watched, topic):
    run, found = watched
    types, recording = RosTypes(2), recording_of(run)
    wanted = [(sample.time_ns, types.data(sample.kind, sample.message))
              for sample in topic_messages(recording, types, Scanner(run.scenario))
              if sample.topic == topic]
    assert len(wanted) > 1
    if topic.endswith("odom"):  # speeds are means since the pose before, which a stretch has not
        wanted, now = ([time_ns for time_ns, _ in each] for each in (wanted, found[topic]))
        assert now == wanted
    else:
        assert found[topic] == wanted


def test_maps_and_markers_come(watched):
    _, found = watched
    assert {"/map", "/robot_0/map", "/terrain", "/robots", "/links", "/diagnostics",
            "/tf_static"} <= set(found)


def test_a_server_for_this_machine(watched):
    run, _ = watched
    with foxglove_served(run.scenario, 0) as (sink, url):
        assert isinstance(sink, Channels)
        assert url.startswith("ws://127.0.0.1:")


def asked(url, host="localhost:8765", origin=None):
    """The answer to asking for a WebSocket, as a stream, and its first line."""
    client = socket.create_connection(("127.0.0.1", int(url.rpartition(":")[2])), timeout=10)
    key = base64.b64encode(b"sixteen bytes ..").decode()
    lines = ["GET / HTTP/1.1", f"Host: {host}", *([f"Origin: {origin}"] if origin else []),
             "Upgrade: websocket", "Connection: Upgrade", f"Sec-WebSocket-Key: {key}",
             "Sec-WebSocket-Version: 13", "Sec-WebSocket-Protocol: foxglove.sdk.v1", "", ""]
    client.sendall("\r\n".join(lines).encode())
    answer = client.makefile("rb")
    client.close()  # with the stream
    return answer, answer.readline().decode().strip()


@pytest.mark.parametrize(("host", "origin", "answer"), [
    ("localhost:8765", None, "101 Switching Protocols"),
    ("127.0.0.1:8765", "https://app.foxglove.dev", "101 Switching Protocols"),
    ("localhost:8765", "file://", "101 Switching Protocols"),
    ("localhost:8765", "https://example.org", "403 Forbidden"),
    ("localhost:8765", "null", "403 Forbidden"),
    ("example.org:8765", "https://app.foxglove.dev", "403 Forbidden")])
def test_only_foxglove_and_this_machine_may_watch(watched, host, origin, answer):
    run, _ = watched
    with foxglove_served(run.scenario, 0) as (_, url):
        stream, line = asked(url, host, origin)
        assert line == f"HTTP/1.1 {answer}"
        stream.close()


def test_messages_come_through_and_clients_that_dawdle_do_not_hold_it(watched):
    """One says nothing, one listens and reads nothing more."""
    run, _ = watched
    with foxglove_served(run.scenario, 0) as (_, url):
        idle = socket.create_connection(("127.0.0.1", int(url.rpartition(":")[2])), timeout=10)
        stream, _ = asked(url)
        found = b""
        while b"serverInfo" not in found:
            found += stream.read1()
    with idle:
        assert idle.recv(1) == b""
    stream.close()
