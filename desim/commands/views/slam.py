"""The outcome of SLAM on a log."""

from __future__ import annotations

from collections.abc import Mapping

from desim.imports.slam_logs.laser_log import LaserLog
from desim.imports.slam_logs.relations import Relations, errors_of
from desim.imports.slam_logs.slam_trial import SlamTrial


def outcome(log: LaserLog, trial: SlamTrial, relations: Relations | None) -> dict[str, object]:
    """The facts of a trial. With relations: ``translation_m`` and ``rotation_deg`` of the final
    path, and the same of the pose as it was known then (``online``) and of the ``odometry``."""
    facts: dict[str, object] = {
        "scans": len(log.times_s), "beams": log.ranges.shape[1],
        "processed": int(trial.processed.sum()), "resampled": trial.resampled,
        "cpu_ms_per_scan": round(1e3 * float(trial.cpu_s.mean()), 4)}
    if relations is None:
        return facts
    path = errors_of(log.times_s, trial.path, relations)
    return {**facts, "relations": len(path.translation_m), **path.summary(),
            "online": errors_of(log.times_s, trial.online, relations).summary(),
            "odometry": errors_of(log.times_s, log.odometry, relations).summary()}


def title(heading: Mapping[str, object]) -> str:
    """A line about what was done."""
    particles = heading["particles"]
    words = [f"{heading['log']}: {heading['localization']}"]
    if particles is not None:
        words.append(f"{particles} particle{'s' if particles != 1 else ''}")
    words.append(f"cells of {heading['resolution_m']:g} m")
    if particles != 1:
        words.append(f"seed {heading['seed']}")
    return ", ".join(words)


def text(facts: Mapping[str, object]) -> str:
    """The facts in lines."""
    resampled = ("" if facts["resampled"] is None
                 else f", particles resampled {facts['resampled']} times")
    lines = [f"{facts['processed']} of {facts['scans']} scans processed ({facts['beams']} beams)"
             f"{resampled}",
             f"CPU time: {facts['cpu_ms_per_scan']:.2f} ms a processed scan"]
    if "relations" in facts:
        rows = [("final path", facts), ("online pose", facts["online"]),
                ("odometry", facts["odometry"])]
        lines.append(f"error over {facts['relations']} relations, mean +- std (max):")
        lines += [f"  {name:<12}{_figures(each, 'translation_m', 3)} m  "
                  f"{_figures(each, 'rotation_deg', 2)} deg" for name, each in rows]
    return "\n".join(lines)


def _figures(errors: object, name: str, digits: int) -> str:
    assert isinstance(errors, Mapping)
    mean, std, most = (errors[name][key] for key in ("mean", "std", "max"))
    return f"{mean:.{digits}f} +- {std:.{digits}f} ({most:.{digits}f})"
