"""The connectivity of a run over time, as a graph."""

from __future__ import annotations

from pathlib import Path

import networkx as nx
import numpy as np
import pyarrow as pa

from desim.errors import InputError
from desim.export.link_loads import changes
from desim.files import target
from desim.results.file_names import LINKS, MESSAGES
from desim.results.message_log import DELIVERED
from desim.results.recording import Recording
from desim.simulation.deployment import HostPlan
from desim.units import MM_PER_M, NS_PER_S

Pair = tuple[str, str]


def write_graphml(recording: Recording, path: Path) -> nx.MultiDiGraph:
    """Write the graph of ``connectivity`` into ``path`` as GraphML, and return it. Raises
    ``InputError`` where the run has no links, or the file cannot be written."""
    if not recording.run.has(LINKS):
        raise InputError(f"{recording.run.path}: has no links")
    graph = connectivity(recording)
    with target(path, "--graphml") as beside:
        nx.write_graphml(graph, beside)
    return graph


def connectivity(recording: Recording) -> nx.MultiDiGraph:
    """Hosts, and an edge from host to other for each time in which frames could get from one to the
    other: ``start_s``, ``end_s`` and ``duration_s``, sampled once a second, and the ``messages``
    and ``bytes`` that were delivered on that way in [start, end).

    A node has its ``kind``, robot or station, and where it stood at the start (``x_m``, ``y_m``),
    if it has a place.
    """
    manifest = recording.run.manifest
    graph = nx.MultiDiGraph(name=manifest["name"], run_id=manifest["run_id"],
                            end_s=recording.end_ns / NS_PER_S)
    for host in recording.hosts:
        graph.add_node(host.name, **_about(recording, host))
    delivered = _deliveries(recording)
    since: dict[Pair, int] = {}
    for change in changes(recording):
        pair = change.host, change.other
        if change.linked:
            since.setdefault(pair, change.time_ns)
        elif pair in since:
            _add(graph, pair, since.pop(pair), change.time_ns, delivered)
    for pair, start_ns in since.items():
        _add(graph, pair, start_ns, recording.end_ns, delivered, last=True)
    return graph


def _about(recording: Recording, host: HostPlan) -> dict[str, object]:
    x_m, y_m = host.x_m, host.y_m
    if host.robot is not None:
        x_m, y_m = (recording.poses.xy_mm[0, host.robot] / MM_PER_M).tolist()
    place = {"x_m": x_m, "y_m": y_m} if np.isfinite(x_m) else {}
    return {"kind": "station" if host.robot is None else "robot", **place}


def _add(graph: nx.MultiDiGraph, pair: Pair, start_ns: int, end_ns: int,
         delivered: dict[Pair, np.ndarray], last: bool = False) -> None:
    times_ns, sizes = delivered.get(pair, np.empty((2, 0), np.int64))
    inside = (times_ns >= start_ns) & ((times_ns < end_ns) | last)
    graph.add_edge(*pair, start_s=start_ns / NS_PER_S, end_s=end_ns / NS_PER_S,
                   duration_s=(end_ns - start_ns) / NS_PER_S, messages=int(inside.sum()),
                   bytes=int(sizes[inside].sum()))


def _deliveries(recording: Recording) -> dict[Pair, np.ndarray]:
    """The arrivals (ns) and sizes [2, n] of messages by source and destination."""
    if not recording.run.has(MESSAGES):
        return {}
    table = recording.messages
    table = table.filter(pa.compute.equal(table["fate"].cast(pa.string()), DELIVERED))
    source, to = (table[name].cast(pa.string()).to_pylist() for name in ("source", "destination"))
    rows: dict[Pair, list[int]] = {}
    for row, pair in enumerate(zip(source, to, strict=True)):
        rows.setdefault(pair, []).append(row)
    both = np.stack([table["end_ns"].to_numpy(), table["size_bytes"].to_numpy()])
    return {pair: both[:, own] for pair, own in rows.items()}
