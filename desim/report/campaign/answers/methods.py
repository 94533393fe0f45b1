"""The methods paragraphs: all that is needed to repeat the campaign."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from contextlib import suppress
from functools import cached_property
from pathlib import Path

from desim.campaign.design.design import (
    Design,
    Function,
    LatinHypercube,
    Levels,
    Saltelli,
    Sobol,
    Span,
    Until,
)
from desim.errors import InputError
from desim.files import content_below
from desim.report.campaign import formatting
from desim.report.campaign.numbers import TIMES, Axis, Study
from desim.report.campaign.numbers.contrasts import Contrast
from desim.results.file_names import SCENARIO
from desim.results.run import Run
from desim.results.seal import Json
from desim.scenario import yaml12
from desim.statistics.intervals import BOOTSTRAP_FROM, BOOTSTRAP_TO, widened

_LISTED = 40  # levels of a parameter in a sentence
_MOST_READ = 200  # manifests, one of each vector
_MOST_BYTES = 10_000_000  # of a design; more is no design
_LONGEST_TEXT = 60_000  # letters of a file that the page holds


class Sources:
    """The records in the runs' folders of how the runs were made; None, or nothing, if no folder is
    left."""

    def __init__(self, study: Study) -> None:
        self._folder, self._folders = study.folder, study.run_folders
        ids = study.text("run_id")
        self._ids = [ids[vector.rows[0]] for vector in study.vectors[:_MOST_READ]]

    @cached_property
    def manifest(self) -> Json | None:
        """Versions and machine, and the plug-ins of all vectors."""
        found = [run.manifest for run in self._runs()]
        if not found:
            return None
        plugins = {kind: name for one in found for kind, name in one.get("plugins", {}).items()}
        return {**found[0], "plugins": plugins}

    @cached_property
    def stop(self) -> Json:
        """The stop conditions of a run."""
        try:
            return yaml12.parse(self.scenario or "", SCENARIO)[0].get("stop", {})
        except InputError:
            return {}

    @cached_property
    def scenario(self) -> str | None:
        """The scenario of one run, every value spelled out."""
        for run in self._runs():
            with suppress(InputError):
                return run.content(SCENARIO).decode(errors="replace")[:_LONGEST_TEXT]
        return None

    @cached_property
    def design(self) -> str | None:
        """The campaign's own copy of its design."""
        with suppress(OSError):
            text = content_below(self._folder, "design.yaml", _MOST_BYTES)
            return text.decode(errors="replace")[:_LONGEST_TEXT]
        return None

    def _runs(self) -> Iterator[Run]:
        """The runs whose folder is there and unchanged."""
        for name in self._ids:
            if name in self._folders:
                with suppress(InputError):
                    yield Run(self._folders[name])


def paragraphs(study: Study, intervals: set[str], resamples: int, sources: Sources,
               metrics: list[str], contrasts: dict[str, list[Contrast]], with_knees: bool,
               wide: str) -> list[str]:
    """The paragraphs, as prose for a paper. ``intervals`` are the methods by which they were made;
    ``wide`` names the metric that is known less well than the design wants."""
    return [_made(study, sources), f"{_design(study)} {wide}".rstrip(),
            _statistics(study, intervals, resamples, metrics, contrasts, with_knees)]


def _made(study: Study, sources: Sources) -> str:
    manifest, design = sources.manifest, study.design
    text = f"The campaign “{design.name}” was simulated with desim"
    if manifest:
        others = ", ".join(f"{name} {version}" for name, version in manifest["versions"].items()
                           if name != "desim")
        plugins = ", ".join(sorted(manifest.get("plugins", {}).values()))
        text += (f" {manifest['desim_version']} (source {manifest['source']}; {others}), with the "
                 f"models {plugins}; {manifest['machine']['libm']} on "
                 f"{manifest['machine']['machine']}")
    text += f". The base scenario was {Path(design.base).name}"
    if design.set:
        text += f", with {_settings(design.set)}"
    # What a parameter sets differs from run to run.
    varied = {getattr(shape, "key", None) for shape in design.parameters.values()}
    shared = {key: value for key, value in (sources.stop or design.stop).items()
              if value is not None and f"stop.{key}" not in varied}
    if shared.get("by") == "none":
        shared = {key: value for key, value in shared.items() if key not in ("explored", "by")}
    stop = f" A run stopped at {_settings(shared)}, whatever came first." if shared else ""
    measure = f" Measured: {_settings(design.measure)}." if design.measure else ""
    return text + "." + stop + measure


def _design(study: Study) -> str:
    design = study.design
    levels = "; ".join(_levels(study, name) for name in study.axes)
    text = [f"{_vectors(study)} of {formatting.counted(len(study.axes), 'parameter')} were run: "
            f"{levels}." if study.axes else "One vector, without parameters, was run."]
    counts = [len(vector.rows) for vector in study.vectors]
    if isinstance(design.iterations, Until):
        rule = design.iterations
        text.append(f"Each vector was repeated until the 95 % interval of {rule.metric} was at "
                    f"most {rule.width} wide, at least {rule.at_least} and at most "
                    f"{rule.at_most} times (between {min(counts)} and {max(counts)} runs).")
    else:
        times = formatting.counted(design.iterations, "time")
        text.append(f"Each vector was run {'once' if design.iterations == 1 else times}.")
    if study.is_paired:
        last = int(study.iterations.max()) + design.seed
        seeds = f" (seeds {design.seed} to {last})" if last > design.seed else ""
        text.append(f"Common random numbers: iteration k of each vector had the seed "
                    f"{design.seed} + k, k from 0{seeds}.")
    else:
        text.append(f"Each run had a seed of its own, derived from {design.seed} and its "
                    "parameters.")
    text.append(outcome(study))
    own = "; ".join(f"{name} = {formula}" for name, formula in design.metrics.items())
    if own:
        text.append(f"Metrics of this campaign: {own}.")
    return " ".join(text)


def outcome(study: Study) -> str:
    """The outcome of the runs in a sentence."""
    once = study.once
    reached, censored, failed = (formatting.number(int((once & which).sum()), 9) for which in (
        study.reached, study.censored & ~study.failed, study.failed))
    shared = "" if once.all() else " (vectors with the same values share theirs)"
    missed = f", {censored} were stopped before it" if study.has_aim else ""
    return (f"{formatting.counted(int(once.sum()), 'run')} ended{shared}, of which {reached} "
            f"{study.success}{missed} and {failed} failed; failed runs are left out of all "
            "estimates.")


def _vectors(study: Study) -> str:
    shape, count = study.design.vectors, formatting.counted(len(study.vectors), "vector")
    if isinstance(shape, LatinHypercube):
        return f"A Latin hypercube sample (McKay et al. 1979): {count}"
    if isinstance(shape, Sobol):
        return f"A scrambled Sobol sequence (Owen 1998): {count}"
    if isinstance(shape, Saltelli):
        return f"A Saltelli design (Saltelli et al. 2010, n = {shape.saltelli}): {count}"
    if isinstance(shape, Function):
        return f"The {count} that {shape.function} lists"
    if shape == "all":
        return f"All combinations ({count})"
    return f"The values one by one ({count})" if shape == "zip" else f"A list of {count}"



def sets(design: Design, name: str) -> str:
    """The keys of the scenario that a parameter sets, or whose levels use it as ``$name``."""
    shape = design.parameters[name]
    if isinstance(shape, Levels):
        return ", ".join(dict.fromkeys(key for keys in shape.levels.values() for key in keys))
    users = [other for other, one in design.parameters.items() if isinstance(one, Levels)
             and f'"${name}"' in json.dumps(one.levels)]
    used = f"${name} in {formatting.listed(users)}" if users else ""
    return ", ".join(filter(None, [shape.key, used]))


def _levels(study: Study, name: str) -> str:
    found = sets(study.design, name)
    return f"{name}{f' ({found})' if found else ''}: {values(study, study.axes[name])}"


def values(study: Study, axis: Axis) -> str:
    """The levels of an axis, or, for samples, the range and the scale from which they were drawn.
    """
    shape = study.design.parameters[axis.name]
    if study.is_sampled and isinstance(shape, Span):
        how = ", evenly in the logarithm" if shape.scale == "log" else ""
        return f"between {shape.from_} and {shape.to}{how}"
    return ", ".join(axis.labels[:_LISTED]) + (
        f" and {len(axis.labels) - _LISTED} more" if len(axis.labels) > _LISTED else "")


def _statistics(study: Study, intervals: set[str], resamples: int, metrics: list[str],
                contrasts: dict[str, list[Contrast]], with_knees: bool) -> str:
    text = ["Intervals are 95 % confidence intervals of the mean over the runs of a vector, from "
            "Student's t" + (
                f", from {BOOTSTRAP_FROM} to {BOOTSTRAP_TO} runs by the bias-corrected and "
                f"accelerated bootstrap (Efron 1987; {resamples} resamples), asked for a level "
                f"widened from z to t and from n to n - 1 (Hesterberg 2015; "
                f"{100 * widened(0.95, BOOTSTRAP_FROM):.1f} % for {BOOTSTRAP_FROM} runs) so that "
                "it holds 95 %" if "bca" in intervals else "") + "."]
    if isinstance(study.design.iterations, Until):
        text.append("Stopping by the width of an interval makes it hold the mean less often than "
                    "it says: the share that it holds was simulated for normal values that spread "
                    "as measured, and stands beside each interval of that metric.")
    with_times = any(metric in TIMES for metric in metrics)
    if with_times:
        text.append("A run that was stopped by its time limit before it got there is "
                    "right-censored at that instant; vectors with runs that stopped for another "
                    "reason before they got there have no such time. Reported are the mean "
                    "restricted to the time limit (Royston and Parmar 2013), the Kaplan-Meier "
                    "median with the interval of Brookmeyer and Crowley (1982), and the mean of "
                    "the successes (Yan et al. 2017).")
    if any(contrasts.values()):
        text.append("Vectors were compared run by run under common random numbers, with the "
                    "paired t test and Wilcoxon's signed-rank test" + (
                        ", times with the limit in place of what was censored" if with_times else ""
                    ) + "; p values were corrected by Holm's method over the "
                    "comparisons of a metric; effect sizes are Cohen's d_z and the matched-pairs "
                    "rank-biserial correlation.")
    if with_knees:
        text.append("Knees are those of two straight lines that meet (Quandt 1958), accepted where "
                    "a wild bootstrap of sup F rejects a single straight line at 5 %"
                    + (f", in the logarithm of {study.axis.name}" if study.axis.log else "")
                    + "; of three lines, where these are accepted against two in the same way (Bai "
                    "and Perron 1998); their intervals invert the same test (Hansen 2017)."
                    + (" What a seed adds at all values of the axis alike was taken out before."
                       if study.is_paired else ""))
    if isinstance(study.design.vectors, Saltelli):
        text.append("Sobol indices: first order as in Saltelli et al. (2010), total as in Jansen "
                    "(1999), intervals by bootstrap over the points.")
    return " ".join(text)


def _settings(settings: Mapping[str, object]) -> str:
    return ", ".join(f"{key} = {value if isinstance(value, str) else _short(value)}"
                     for key, value in settings.items())


def _short(value: object) -> str:
    text = json.dumps(value)
    return text if len(text) <= 80 else "(see the design)"
