"""The key figures of a run, in words, for terminals and notebooks."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from desim.results.status import is_imported
from desim.units import rate_text, size_text

Summary = Mapping[str, Any]  # of summary.json, or of manifest.json

_UNITS = ("s", "m", "m2")  # with which names of metrics end


def key_figures(metrics: Summary, manifest: Summary) -> list[tuple[str, str, str]]:
    """Name, value and remark of each figure of a run."""
    if is_imported(manifest):
        return [(name, value, "") for name, value in imported_figures(metrics)]
    peak_mb = manifest["peak_memory_mb"]  # None where the system does not say
    speed = ("speed", f"{manifest['real_time_factor']:.1f} times real time (CPU)",
             f"{metrics['simulated_s']:.1f} s in {manifest['cpu_s']:.1f} s of CPU"
             + ("" if peak_mb is None else f", {peak_mb:.0f} MB"))
    return [*_task(metrics), *_map_and_way(metrics), *_network(metrics), *_processors(metrics),
            *_saturated(metrics), *_energy(metrics), speed]


def headline(metrics: Summary, manifest: Summary) -> str:
    """Name, seed, status and why it ended."""
    if is_imported(manifest):
        return f"{manifest['name']}: imported from {metrics['imported_from']}"
    return (f"{manifest['name']}, seed {manifest['seed']}: {manifest['status']}, "
            f"{metrics['stop_reason']}")


def imported_figures(metrics: Summary) -> list[tuple[str, str]]:
    """Name and value of each figure of a run that was imported."""
    found = [("imported from", metrics["imported_from"]),
             ("driven", f"{metrics['exploration_cost_m']:,.0f} m")]
    if metrics["messages_delivered"] is not None:
        found.append(("messages", f"{metrics['messages_delivered']:,} delivered"))
    return found


def _task(m: Summary) -> list[tuple[str, str, str]]:
    if "exploration_time_s" in m:
        return _exploration(m)
    if not m["robots"]:
        return []
    return [("task", m["task"], ""), *(
        (f"  {name}", value, "") for name, value in task_figures(m))]


def task_figures(m: Summary) -> list[tuple[str, str]]:
    """Name and value of each metric of a task other than exploration: ``idleness mean`` and
    ``12.3 s`` of ``idleness_mean_s``."""
    found = []
    for metric in m["task_metrics"]:
        value, (stem, _, unit) = m[metric], metric.rpartition("_")
        if isinstance(value, (list, dict)):
            continue
        name = stem if unit in _UNITS else metric
        text = "-" if value is None else f"{value:.4g}" if isinstance(value, float) else str(value)
        found.append((name.replace("_", " "),
                      f"{text} {unit}" if unit in _UNITS and value is not None else text))
    return found


def _exploration(m: Summary) -> list[tuple[str, str, str]]:
    limit = m["simulated_s"]
    return [
        ("exploration time", time_or_limit(m["exploration_time_s"], limit),
         f"not reached; best {m['explored']:.2%}" if m["censored"] else
         f"99 % known to {m['judged_robot']}"),
        ("  of the union", time_or_limit(m["union_time_s"], limit), "99 % known to some robot"),
        ("  of the fleet", time_or_limit(m["fleet_time_s"], limit), "99 % known to every robot"),
    ]


def _map_and_way(m: Summary) -> list[tuple[str, str, str]]:
    if not m["robots"]:
        return []
    efficiency = m["exploration_efficiency_m2_per_m"]
    return [
        ("explored area", f"{m['explored_area_m2']:.0f} m2", f"of {m['reachable_area_m2']:.0f} m2"),
        ("cost", f"{m['exploration_cost_m']:.0f} m", "driven by all robots"),
        *([("  wasted", f"{m['outdated_goal_m']:.0f} m",
            f"{m['outdated_goal_s']:.0f} s, towards what a teammate had explored")]
          if "outdated_goal_m" in m else []),
        ("efficiency", "-" if efficiency is None else f"{efficiency:.2f} m2/m", "area / cost"),
        ("map completeness", f"{m['map_completeness']:.4f}", ""),
        ("map quality", f"{m['map_quality']:.4f}", _counted(m["map_error_cells"], "wrong cell")),
        ("safety", f"{m['safety']:.2f}", _counted(m["collisions"], "collision")),
        ("recoveries", str(m["recoveries"]), ""),
    ]


def _network(m: Summary) -> list[tuple[str, str, str]]:
    rows = [
        ("messages", f"{m['messages_sent']} sent", f"{m['messages_delivered']} delivered"),
        ("", f"{m['messages_in_flight']} in flight", "at the end"),
        *([("", f"{m['messages_unmatched']} unmatched", "not known who listens")]
          if m.get("messages_unmatched") else []),
        *(("", f"{count} dropped", reason) for reason, count in m["messages_dropped"].items()),
        ("on the air", size_text(m["bytes_on_air"]),
         f"{rate_text(8 * m['bytes_on_air'] / max(m['simulated_s'], 1e-9))}, all hosts together"),
        *(("", f"{count} packets", f"lost: {reason}")
          for reason, count in m.get("packets_lost", {}).items()),
        *(("", f"{share['mean']:.1%} busy", medium if share["mean"] == share["max"] else
           f"{medium}, mean of its parts; at most {share['max']:.1%}")
          for medium, share in m.get("utilisation", {}).items() if share is not None),
    ]
    rows += [("background", f"{flow['sent']} packets",
              f"{' to '.join(flow['between'])}, {flow['delivered']} delivered")
             for flow in m.get("background", ())]
    if m.get("control_bytes"):
        rows.append(("", f"{m['control_bytes'] / 1e6:.1f} MB", "of protocols of networks, beside"))
    if m.get("handovers"):
        gaps_s = [one["gap_s"] for one in m["handovers"]]
        rows.append(("handovers", str(len(gaps_s)), f"without an access point for "
                                                    f"{sum(gaps_s):.2g} s in all, at most "
                                                    f"{max(gaps_s):.2g} s"))
    apart = m["partitions"]
    if apart["count"]:
        rows.append(("partitions", str(apart["count"]), f"{apart['total_s']:.0f} s in all, the "
                                                        f"longest {apart['longest_s']:.0f} s"))
    return rows + _awareness(m)


def _processors(m: Summary) -> list[tuple[str, str, str]]:
    if m.get("mean_cpu_percent") is None:
        return []
    busiest = max(robot["cpu_percent"] for robot in m["robots"].values()
                  if robot["cpu_percent"] is not None)
    waited_s = sum(node["waited_s"] for node in m.get("cluster_nodes", {}).values())
    return [("processors", f"{m['mean_cpu_percent']:.1f} % busy",
             f"of the robots', on average; at most {busiest:.1f} %"),
            *(("", f"{host['cpu_percent']:.1f} % busy", f"of {name}'s")
              for name, host in m.get("hosts", {}).items()),
            *([("", f"{waited_s:.1f} s", "that virtual ones waited for those of their nodes")]
              if waited_s else []),
            ("", _counted(m["missed_ticks"], "missed tick"), "of timers whose nodes were busy"),
            *_memory(m)]


def _memory(m: Summary) -> list[tuple[str, str, str]]:
    if m.get("mean_ram_mb") is None:
        return []
    most_mb = max(robot["peak_ram_mb"] for robot in m["robots"].values()
                  if robot["peak_ram_mb"] is not None)
    rows = [("memory", f"{m['mean_ram_mb']:.0f} MB",
             f"of the robots', on average; at most {most_mb:.0f} MB")]
    if m["memory_kills"]:
        rows.append(("", f"{m['memory_kills']} killed", "processes, for want of memory"))
    return rows + [("", f"{sum(host['killed'].values())} killed",
                    f"processes of {name}, for want of memory")
                   for name, host in m.get("hosts", {}).items() if host["killed"]]


def _saturated(m: Summary) -> list[tuple[str, str, str]]:
    first = m.get("saturated_first")
    if first is None:
        return []
    found = m["saturation"][first]
    part = found.get("part")
    return [("saturates first", first,
             f"from {found['from_s']:.0f} s on" + (f": {part}" if part else ""))]


def _energy(m: Summary) -> list[tuple[str, str, str]]:
    if m.get("energy_j") is None:
        return []
    parts = ", ".join(f"{part} {m[f'{part}_j'] / 1e3:.1f}" for part in (
        "drive", "sensors", "compute", "radio"))
    return [("energy", f"{m['energy_j'] / 1e3:.1f} kJ", parts)]


def _awareness(m: Summary) -> list[tuple[str, str, str]]:
    rows = []
    if m.get("discovery_frames"):
        size_bytes = m["discovery_bytes"]
        rows.append(("discovery", f"{size_bytes / 1e6:.1f} MB" if size_bytes >= 1e6 else
                     f"{size_bytes / 1e3:.1f} kB", f"in {m['discovery_frames']} frames"))
    for key, name, done in (("detection_delay_s", "loss noticed", "noticed"),
                            ("resync_delay_s", "heard again", "resynced")):
        delay = m.get(key, {})
        if delay.get("pairs"):
            pairs = f"{delay[done]} of {delay['pairs']} pairs"
            rows.append((name, "never", pairs) if delay["mean"] is None else
                        (name, f"{delay['mean']:.1f} s", f"later on average, {pairs}"))
    if m.get("false_alarms"):
        rows.append(("false alarms", str(m["false_alarms"]),
                     "robots taken for gone that were up and in reach"))
    return rows


def time_or_limit(value: float | None, limit: float) -> str:
    """A time in s; None: it was not reached until ``limit``."""
    return f"> {limit:.1f} s" if value is None else f"{value:.1f} s"


def _counted(count: int, what: str) -> str:
    return f"{count} {what}" if count == 1 else f"{count} {what}s"
