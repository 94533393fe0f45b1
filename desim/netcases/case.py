"""Plays a network case: sources send over one medium, and the fates of their frames are counted.

There are no robots, nodes or topics in between; a frame is one packet, or TCP's.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from typing import Any, TypeAlias

import numpy as np

from desim import ports
from desim.engine.kernel import Kernel
from desim.engine.streams import Streams
from desim.engine.trace import Names
from desim.errors import InputError
from desim.monitor.utilisation import busy_ns, utilisation
from desim.netcases.setup_places import SetupPlaces
from desim.netcases.sources import PacketSource, Source
from desim.netcases.tcp_source import TcpSource, stack_on
from desim.network.carrier import AnyCarrier
from desim.network.medium import Medium
from desim.ports.cases import Flow, Setup
from desim.units import NS_PER_S, PERIOD

Watch = Callable[[Kernel, int], None]
Measures: TypeAlias = dict[str, Any]  # numbers, and mappings of numbers, by name

_BATCHES = 20  # of the delays, for the standard error of their mean


def play(setup: Setup, seed: int = 1, watch: Watch | None = None) -> Measures:
    """Play ``setup`` and measure. Every key is there in every case; None: it has no meaning there.
    Raises ``InputError`` for a setup that cannot be played. ``watch`` is called with each kernel
    and the time until which it will run. Of a flow over TCP, its messages count as frames.

    ``goodput_mbps``, ``throughput_mbps``: payloads, and frames with their headers, that arrived,
    each copy of a broadcast | ``offered_mbps``: payloads sent, for each receiver (None: saturated)
    | ``fairness``: Jain's index of the flows' goodput | ``frames`` sent | ``delivered``, ``lost``
    (by reason): receivers of frames that were settled | ``delivery_ratio``, ``loss``: their shares
    | ``drop_rate``: lost by other reasons than a full queue, among those that were let in (None:
    broadcast) | ``attempts``: transmissions, where the model counts them | ``failure_rate``: the
    share of them that failed | ``delay_mean_ms``, ``_p50_``, ``_p95_``, ``_p99_``: from sending to
    arriving | ``delay_error_ms``: standard error of the mean, of 20 batches |
    ``goodput_mbps_by_mark`` and so on: of flows with the same DSCP | ``control_frames``,
    ``control_bytes``: sent by the model's own protocols, where it counts them | ``utilisation``:
    the share of time that the medium was busy, mean and max over its hosts, ports or cables, where
    the model says it | ``goodput_share``: of the goodput of the setup that this one is compared
    with | ``measured_s``.
    """
    measures = _play(setup, seed, watch)
    compared = setup.compared and play(setup.compared, seed, watch)
    measures["goodput_share"] = compared and _share(measures["goodput_mbps"],
                                                    compared["goodput_mbps"])
    return measures


def _play(setup: Setup, seed: int, watch: Watch | None) -> Measures:
    _check(setup)
    hosts = tuple(sorted(setup.places, key=ports.natural_key))
    kernel, names = Kernel(), Names()
    if watch is not None:
        watch(kernel, setup.duration_ns)
    medium = Medium("case", setup.model, setup.rules, kernel=kernel, names=names,
                    streams=Streams(seed), hosts=hosts,
                    place=SetupPlaces(setup, hosts), mark=_mark if any(
                        flow.dscp for flow in setup.flows) else None)
    streams = Streams(seed)
    sources: list[Source] = []
    tcp = stack_on(medium, hosts, kernel, names, streams) if any(
        flow.protocol == "tcp" for flow in setup.flows) else None
    for number, flow in enumerate(setup.flows):
        entity = names.id(f"{flow.source} {number}")
        sources.append(PacketSource(flow, hosts, kernel, entity, medium)
                       if tcp is None or flow.protocol == "udp"
                       else TcpSource(flow, hosts, kernel, entity, tcp))
        sources[-1].begin(streams("case", "flow", number))
    before: dict[str, tuple[int, int]] = {}
    before_ns: np.ndarray | None = None
    if setup.warm_up_ns:
        kernel.run(setup.warm_up_ns)
        before, before_ns = _counted(setup.model), busy_ns(medium)
        for source in sources:
            source.forget()
    kernel.run(setup.duration_ns)
    counts = {name: tuple(np.subtract(count, before.get(name, 0)).tolist())
              for name, count in _counted(setup.model).items()}
    measured_ns = setup.duration_ns - setup.warm_up_ns
    return {**_measures(sources, counts, measured_ns / NS_PER_S),
            "utilisation": utilisation(medium, measured_ns, 0 if before_ns is None else before_ns)}


def _mark(carrier: AnyCarrier, _: object) -> int:
    return carrier.flow.dscp if isinstance(carrier, PacketSource) else 0


def _check(setup: Setup) -> None:
    if setup.duration_ns > PERIOD.maximum:
        raise InputError(f"it would last {setup.duration_ns / NS_PER_S:.3g} simulated seconds; at "
                         f"most {PERIOD.maximum / NS_PER_S:.3g}")
    for flow in setup.flows:
        if flow.arrivals != "saturated" and flow.every_ns < 1:
            raise InputError(f"{flow.source} would send a frame every {flow.every_ns} ns; at most "
                             "one each ns")
        if flow.train > 1:
            _check_train(flow)


def _check_train(flow: Flow) -> None:
    """Raises ``InputError`` for trains that cannot be."""
    if flow.broadcast or flow.via or flow.echo or flow.protocol == "tcp":
        raise InputError(f"{flow.source} would send trains of {flow.train} packets; allowed: of "
                         "unicast packets of UDP that go one way, without via")
    sizes = ports.packet_sizes(flow.train * flow.size_bytes, flow.train)
    if sizes[0] != sizes[-1]:
        raise InputError(f"{flow.source} would send trains of {flow.train} packets of "
                         f"{flow.size_bytes} B, which are cut into packets of {sizes[0]} and "
                         f"{sizes[-1]} B; allowed: as many or as long ones as are cut into equal "
                         "packets")


def _counted(model: ports.NetworkModel) -> dict[str, tuple[int, int]]:
    """The counts of the model itself, so far."""
    counted = {}
    if isinstance(model, ports.CountsAttempts):
        counted["attempts"] = model.attempts()
    if isinstance(model, ports.CountsControl):
        counted["control"] = model.control()
    return counted


def _measures(sources: list[Source], counts: dict[str, tuple[int, int]],
              seconds: float) -> Measures:
    lost = sum((source.losses for source in sources), Counter())
    delivered = sum(len(source.delays_ns) for source in sources)
    settled = delivered + sum(lost.values())
    let_in = settled - lost["queue_full"]
    by_flow = [source.flow.payload_bytes * len(source.delays_ns) for source in sources]
    unicast = not any(source.flow.broadcast for source in sources)
    transmitted, failed = counts.get("attempts", (None, None))
    control_frames, control_bytes = counts.get("control", (None, None))
    megabits_per_s = 8e-6 / seconds
    return {
        "goodput_mbps": sum(by_flow) * megabits_per_s,
        "throughput_mbps": megabits_per_s * sum(
            source.flow.size_bytes * len(source.delays_ns) for source in sources),
        "offered_mbps": None if any(
            source.flow.arrivals == "saturated" for source in sources) else megabits_per_s * sum(
            source.flow.payload_bytes * source.sent * len(source.flow.receivers)
            for source in sources),
        "fairness": _share(sum(by_flow) ** 2, len(by_flow) * sum(size ** 2 for size in by_flow)),
        "frames": sum(source.sent for source in sources),
        "delivered": delivered,
        "lost": dict(sorted(lost.items())),
        "delivery_ratio": _share(delivered, settled),
        "loss": _share(settled - delivered, settled),
        "drop_rate": _share(let_in - delivered, let_in) if unicast else None,
        "attempts": transmitted,
        "failure_rate": (None if failed is None or not (unicast and transmitted)
                         else _share(failed, transmitted or 0)),
        **_delays(sources),
        **_by_mark(sources, megabits_per_s),
        "control_frames": control_frames,
        "control_bytes": control_bytes,
        "measured_s": seconds,
    }


def _by_mark(sources: list[Source], megabits_per_s: float) -> dict[str, dict[str, float | None]]:
    found: dict[str, dict[str, float | None]] = {
        f"{name}_by_mark": {} for name in ("goodput_mbps", "delay_mean_ms", "delay_p95_ms")}
    for mark in sorted({source.flow.dscp for source in sources}):
        own = [source for source in sources if source.flow.dscp == mark]
        delays = _delays(own)
        found["goodput_mbps_by_mark"][str(mark)] = megabits_per_s * sum(
            source.flow.payload_bytes * len(source.delays_ns) for source in own)
        for name in "delay_mean_ms", "delay_p95_ms":
            found[f"{name}_by_mark"][str(mark)] = delays[name]
    return found


def _share(part: float, whole: float) -> float | None:
    return part / whole if whole else None


def _delays(sources: list[Source]) -> dict[str, float | None]:
    delays_ms, arrivals_ns = (np.concatenate([[], *arrays]) for arrays in (
        [np.array(source.delays_ns) / 1e6 for source in sources],
        [source.arrivals_ns for source in sources]))
    order = np.argsort(arrivals_ns, kind="stable")
    measures: dict[str, float | None] = dict.fromkeys(
        ("delay_mean_ms", "delay_error_ms", *(f"delay_p{share}_ms" for share in (50, 95, 99))))
    if len(delays_ms):
        measures["delay_mean_ms"] = float(delays_ms.mean())
        for share in (50, 95, 99):
            measures[f"delay_p{share}_ms"] = float(np.percentile(delays_ms, share))
    if len(delays_ms) >= 10 * _BATCHES:
        means = [batch.mean() for batch in np.array_split(delays_ms[order], _BATCHES)]
        measures["delay_error_ms"] = float(np.std(means, ddof=1)) / _BATCHES ** 0.5
    return measures
