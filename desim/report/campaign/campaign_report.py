"""The report of a campaign, from its folder to a page, figures and tables."""

from __future__ import annotations

from pathlib import Path
from tempfile import TemporaryDirectory

from matplotlib.figure import Figure

from desim.campaign.design.design import Design
from desim.errors import unwritable
from desim.files import refuse_link
from desim.report.campaign import formatting
from desim.report.campaign.answers import findings, groups, methods, rungs, sensitivity, warnings
from desim.report.campaign.answers.answer import answer_of, runs_of
from desim.report.campaign.figures import style, time_series
from desim.report.campaign.figures.latency import latency_figure
from desim.report.campaign.figures.metric import caption, metric_figure, reading
from desim.report.campaign.numbers import Estimates, Study, contrasts, knees, latencies, lines
from desim.report.campaign.page import page
from desim.report.campaign.page.page import Section
from desim.report.campaign.tables import latency, overview, resources
from desim.report.campaign.tables.table import Cell, ReportTable, as_csv, as_html, as_latex
from desim.report.drawing import drawing

_PAGE = "report.html"
_LEADING = 4  # panels in the figure of the first screen
_OPEN = 15  # up to so many comparisons of a metric are not folded away


def write(folder: Path, design: Design, out: Path | None = None) -> Path:
    """Write the report of the campaign in ``folder`` to ``out`` (``folder/report``); returns the
    page. Raises ``InputError`` for a folder without runs, or one that cannot be written. It is
    written aside and then moved, the page last: what goes wrong leaves what was there."""
    study = Study(folder, design)
    try:
        if out is None:
            out = folder / "report"
            refuse_link(out)
        out.parent.mkdir(parents=True, exist_ok=True)
        place = out if out.is_dir() else out.parent  # of one file system with where it goes
        with TemporaryDirectory(dir=place, prefix=".report.") as temporary:
            new = Path(temporary)
            for below in ("figures", "tables"):
                (new / below).mkdir()
            with drawing(style.RC):
                (new / _PAGE).write_text(_Report(study, new).page(), encoding="utf-8")
            _move(new, out)
    except OSError as error:
        raise unwritable(f"--out: {out}", error) from error
    return out / _PAGE


def _move(new: Path, out: Path) -> None:
    for below in ("figures", "tables"):
        refuse_link(out / below)
        (out / below).mkdir(parents=True, exist_ok=True)
        for file in (new / below).iterdir():
            file.replace(out / below / file.name)
    (new / _PAGE).replace(out / _PAGE)


class _Report:
    """Puts the page together, and writes figures and tables on the way."""

    def __init__(self, study: Study, out: Path) -> None:
        self._study, self._out = study, out
        self._estimates = Estimates(study)
        self._single, self._groups = groups.presented(study)
        self._panels = lines.panels(study)
        self._drawn = lines.chosen(self._panels)
        self._vectors = [vector for panel in self._drawn for line in panel.lines
                         for vector in line.vectors]
        self._found = {metric: contrasts.contrasts(study, self._estimates, metric)
                       for metric in self._single}
        self._knees = knees.Knees(study, self._estimates, sum(
            len(panel.lines) for panel in self._drawn) * sum(
            [len(self._single), *(len(group.metrics) for group in self._groups)]))
        self._bends = {metric: self._bends_of(metric) for metric in self._single}
        self._onsets = {group: groups.order_of_onset(study, self._estimates, self._knees, group,
                                                    self._drawn)
                        for group in self._groups}
        self._sources = methods.Sources(study)
        self._wide = warnings.about_width(study, self._estimates)

    def page(self) -> str:
        """The document."""
        study = self._study
        how = "" if study.is_sampled else page.paragraph(reading(study), "note")
        return page.page(study.design.name, study.design.question, self._lead(), [
            self._findings(), self._run(), Section("metrics", "Metrics", how),
            *map(self._metric, self._single), *map(self._group, self._groups), *self._explored(),
            *self._latency(), *self._resources(), self._table(), self._methods(),
            self._files()])  # the list of files is last

    def _lead(self) -> str:
        study, estimates = self._study, self._estimates
        metrics = list(self._single)
        said = [*answer_of(study, estimates, metrics, self._bends[metrics[0]] if metrics else []),
                *(sentence for group in self._groups for sentence in self._onsets[group][1])]
        seen = ""
        if metrics and not study.is_sampled:
            few = self._drawn[:_LEADING]
            more = "" if len(few) == len(self._drawn) else \
                f"{len(few)} of {len(self._drawn)} panels; the others are below. "
            seen = self._figure(metric_figure(study, estimates, metrics[0], few, []), "answer",
                                f"{formatting.titled(metrics[0])}: means, their 95 % intervals "
                                f"(bars) and single runs (dots). {more}")
        return page.lead(said, runs_of(study), seen)

    def _findings(self) -> Section:
        study, table = self._study, findings.glance(self._study, self._estimates, self._bends)
        said = [sentence for metric in self._single if rungs.is_ladder(study)
                for sentence in rungs.sentences(study, metric, self._rungs(metric))]
        said += [*findings.failed(study), *findings.unreached(study), *resources.sentences(study),
                 *findings.significant(self._found)]
        if study.is_sampled:
            said += [sentence for metric in self._single
                     for sentence in sensitivity.sentences(study, self._estimates, metric)]
        elif not said and not any(bend.knees for bends in self._bends.values() for bend in bends):
            said = ["No knee and no significant difference was found with these runs."]
        body = ("" if table is None else self._written(table, stacked=True)) + page.items(said)
        if max(len(vector.rows) for vector in study.vectors) == 1 and not study.is_sampled:
            body += page.paragraph("One run a vector: there are no intervals and no comparisons, "
                                   "and knees rest on how the points scatter around lines.",
                                   "warn")
        body += warnings.about_metrics(study, self._single, self._groups) \
            + warnings.about_few(study, self._estimates, self._single)
        if self._wide:
            body += page.paragraph(self._wide, "warn")
        return Section("findings", "In short", body)

    def _run(self) -> Section:
        study = self._study
        rows: list[list[Cell]] = [
            [axis.name, methods.sets(study.design, axis.name), len(axis.labels),
             methods.values(study, axis)] for axis in study.axes.values()]
        head = ["parameter", "sets", "levels", "values"]
        body = page.paragraph(methods.outcome(study))
        if rows:
            body += self._written(ReportTable("parameters", "Parameters.", head, rows, head, rows))
        if study.design.metrics:
            body += page.paragraph("Metrics of this campaign:") + page.items(
                [f"{name} = {formula}" for name, formula in study.design.metrics.items()])
        return Section("run", "What was run", body + warnings.failures(study))

    def _metric(self, metric: str) -> Section:
        study, estimates = self._study, self._estimates
        parts = []
        if study.is_sampled:
            parts += self._sampled(metric)
        else:
            bends = self._bends[metric]
            drawn = metric_figure(study, estimates, metric, self._drawn, bends)
            parts += [self._figure(drawn, metric, caption(study, estimates, metric, self._vectors)
                                   + lines.left_out(self._panels, self._drawn)),
                      page.items(knees.sentences(bends, study.axis, metric) if bends else [])]
        if rungs.is_ladder(study):
            parts.append(self._written(rungs.table(study, metric, self._rungs(metric))))
        covered = warnings.coverage(study, estimates, metric)
        parts.append(page.folded("By vector", self._written(overview.one_metric(
            study, estimates, metric, self._vectors,
            {number: one.share for number, one in covered.items()}))))
        if self._found[metric]:
            clear = findings.largest_effect(metric, self._found[metric])
            parts.append(page.folded(
                f"Comparisons ({len(self._found[metric])})",
                (page.paragraph(clear) if clear else "")
                + self._written(overview.compared(metric, self._found[metric])),
                opened=len(self._found[metric]) <= _OPEN))
        shares = [one.share for one in covered.values()]
        parts.append("" if not covered else page.paragraph(
            "Iterations ended by the width of this metric's interval, which makes intervals "
            f"hold the mean less often than 95 %: by simulation {min(shares):.1%} to "
            f"{max(shares):.1%}, depending on the vector.", "warn") + page.folded(
            "Measured coverage", self._written(
                warnings.coverage_table(study, estimates, metric, covered))))
        return Section(f"metric-{formatting.plain(metric)}", formatting.titled(metric),
                       "\n".join(parts), 3)

    def _sampled(self, metric: str) -> list[str]:
        study = self._study
        parts = [self._figure(sensitivity.scatter_figure(study, self._estimates, metric), metric,
                              f"{formatting.titled(metric)} over each parameter; a dot a vector. ")]
        found = sensitivity.sobol(study, self._estimates, metric)
        if found is not None and found[0].first is not None:
            parts += [self._figure(sensitivity.sobol_figure(study, found, metric),
                                   f"{metric}_sobol",
                                   f"Sobol indices of {formatting.titled(metric)}. "),
                      self._written(sensitivity.sobol_table(study, found, metric))]
        return parts

    def _bends_of(self, metric: str) -> list[knees.LineKnees]:
        axis = self._study.against
        if self._study.is_sampled or axis is None or not axis.is_numeric:
            return []
        return [self._knees.of(metric, line, panel.place(line)) for panel in self._drawn
                for line in panel.lines]

    def _rungs(self, metric: str) -> list[rungs.Rung]:
        return rungs.compared(self._study, self._estimates, metric)

    def _group(self, group: groups.MetricGroup) -> Section:
        drawn = groups.group_figure(self._study, self._estimates, group, self._drawn)
        table, said = self._onsets[group]
        body = self._figure(drawn, group.name, f"{group.common} by {self._study.axis.name}: means "
                            "with their 95 % intervals. ")
        return Section(formatting.plain(group.name), f"{group.common}: which falls first",
                       body + page.items(said) + self._written(table), 3)

    def _explored(self) -> list[Section]:
        study = self._study
        drawn = None if study.is_sampled or "explored" not in study.metrics \
            else time_series.explored_figure(study, self._drawn)
        return [] if drawn is None else [Section("time", "Explored share over time", self._figure(
            drawn, "explored_over_time", "Median and quartiles over the runs of a vector of what "
            "the robot that knows most knows; a run that has ended keeps its last share. "))]

    def _latency(self) -> list[Section]:
        study = self._study
        found = latencies.by_topic_and_vector(study, self._estimates)
        if not found:
            return []
        parts = []
        if any(one.latency for one in found):
            drawn, left_out = latency_figure(study, found)
            parts.append(self._figure(
                drawn, "latency_parts", "Mean latency of delivered messages by topic, in its "
                "parts. Means over the runs that kept a ledger, with the 95 % interval of the "
                f"whole as a dark line. {left_out}"))
        parts.append(page.folded("By topic and vector", self._written(
            latency.latency_table(study, found), wide=True)))
        ages = latency.age_table(study, found)
        if ages is not None:
            parts.append(page.folded("Before the birth, and on the way", self._written(ages)))
        lost = latency.loss_table(study, found)
        parts.append(page.paragraph("No message was lost.") if lost is None else page.folded(
            "Losses by reason and place", self._written(lost)))
        return [Section("latency", "Where messages' time went", "\n".join(parts))]

    def _resources(self) -> list[Section]:
        table = resources.resources_table(self._study)
        return [] if table is None else [Section("resources", "Which resource saturates first",
                                                 self._written(table))]

    def _table(self) -> Section:
        table, others = overview.all_metrics(self._study, self._estimates)
        body = self._written(table, wide=True)
        if others is not None:
            count = len(others.head) - len(overview.vector_head(self._study))
            body += page.folded(f"Other metrics ({count})", as_html(others))
        return Section("table", "Metrics by vector", body)

    def _methods(self) -> Section:
        study, sources = self._study, self._sources
        body = "".join(map(page.paragraph, methods.paragraphs(
            study, {self._estimates.of(metric, vector).method for metric in self._single
                    for vector in self._vectors}, self._estimates.resamples, sources,
            self._single, self._found,
            any(one.was_sought for bends in self._bends.values() for one in bends), self._wide)))
        for title, text in (("The design", sources.design),
                            ("The scenario of one run, every value spelled out",
                             sources.scenario)):
            if text:
                body += page.folded(title, page.verbatim(text))
        return Section("methods", "Methods", body)

    def _files(self) -> Section:
        names = sorted(path.relative_to(self._out).as_posix() for below in ("figures", "tables")
                       for path in (self._out / below).iterdir())
        links = "".join(f'<li><a href="{name}">{name}</a></li>' for name in names)
        return Section("files", "Files", page.paragraph(
            "Each run is a row of runs.parquet in the campaign's folder.") + page.folded(
            formatting.counted(len(names), "file"), f"<ul>{links}</ul>"))

    def _figure(self, drawn: Figure, name: str, caption: str) -> str:
        name = formatting.plain(name)
        svg = style.save(drawn, self._out / "figures", name, caption.partition(". ")[0])
        return page.figure(svg, name, caption)

    def _written(self, table: ReportTable, wide: bool = False, stacked: bool = False) -> str:
        """Write a table into files, a ``wide`` one not for LaTeX; returns it for the page."""
        table = table._replace(name=formatting.plain(table.name))
        as_csv(table, self._out / "tables")
        if not wide:
            as_latex(table, self._out / "tables")
        return as_html(table, stacked)

