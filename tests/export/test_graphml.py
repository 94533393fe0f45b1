"""``desim export --graphml``: who could reach whom, when, and what went that way."""

from __future__ import annotations

import networkx as nx
import pytest
from recorded import made

from desim.api import recording_of
from desim.export.graphml import write_graphml
from desim.units import NS_PER_S

PARTED = ("deployment=field", "stop.elapsed=12 s", "coordination.exchange.period=1 s",
         "network.media.wifi={model: disk, rules: [{rule: partition, from: 4 s, until: 8 s, "
         "groups: [[robot_0], [robot_1, robot_2]]}]}")


@pytest.fixture(scope="module")
def recording(repository, tmp_path_factory):
    return recording_of(made(repository, tmp_path_factory.mktemp("results"), *PARTED))


@pytest.fixture(scope="module")
def graph(recording, tmp_path_factory):
    path = tmp_path_factory.mktemp("graph") / "net.graphml"
    write_graphml(recording, path)
    return nx.read_graphml(path)


def spans(graph, host, other) -> list[tuple[float, float]]:
    return sorted((edge["start_s"], edge["end_s"])
                  for edge in graph.get_edge_data(host, other).values())


def test_edges_are_the_times_in_which_frames_get_through(recording, graph):
    assert spans(graph, "robot_1", "robot_2") == [(0.0, 12.0)]
    assert spans(graph, "robot_0", "robot_1") == [(0.0, 4.0), (8.0, 12.0)]
    assert graph.is_multigraph() and graph.is_directed()
    for change in recording.links:  # each change begins or ends an edge
        times = [time for span in spans(graph, change.host, change.other) for time in span]
        assert change.time_ns / NS_PER_S in times


def test_messages_and_bytes_are_those_that_were_delivered(recording, graph):
    rows = [row for row in recording.messages.to_pylist() if row["fate"] == "delivered"]
    edges = [edge for *_, edge in graph.edges(data=True)]
    assert sum(edge["messages"] for edge in edges) == len(rows) > 10
    assert sum(edge["bytes"] for edge in edges) == sum(row["size_bytes"] for row in rows)


def test_nodes_say_what_they_are(recording, graph):
    assert dict(graph.nodes(data="kind")) == dict.fromkeys(recording.robots, "robot")
    x_mm, y_mm = recording.poses.xy_mm[0, 1]
    assert graph.nodes["robot_1"]["x_m"] * 1000 == x_mm
    assert graph.graph["run_id"] == recording.run.manifest["run_id"]
