"""Runs, campaigns and comparisons in a notebook: tables, and the replay in a frame of its own."""

from __future__ import annotations

import base64
import html
from collections.abc import Iterable, Sequence

from desim.campaign.folder.campaign import Campaign
from desim.campaign.folder.comparison import ComparedCampaigns
from desim.errors import InputError
from desim.report.key_figures import headline, key_figures
from desim.report.side_by_side import key_rows, metric_cells, outcome, value
from desim.results.comparison import ComparedRuns
from desim.results.file_names import POSES, SUMMARY
from desim.results.run import Run
from desim.results.status import RunStatus

_DPI = 72  # of the picture: 790 x 720 pixels
_LEFT = ' style="text-align:left"'
_MOST_ROWS = 40
_MOST_BYTES = 5_000_000  # of a replay in a notebook's file
_HEIGHT_PX = 720


def html_of(thing: object) -> str:
    """A run, a campaign or a comparison as HTML; damage is named where it would stand."""
    try:
        if isinstance(thing, Run):
            return "".join(_run(thing))
        if isinstance(thing, Campaign):
            return "".join(_campaign(thing))
        if isinstance(thing, ComparedRuns | ComparedCampaigns):
            return "".join(_compared(thing))
    except InputError as error:
        return f"<pre>{html.escape(str(error))}</pre>"
    return f"<pre>{html.escape(repr(thing))}</pre>"


def _run(run: Run) -> Iterable[str]:
    manifest = run.manifest
    if not run.has(SUMMARY):
        yield _heading(f"{manifest['name']}, seed {manifest['seed']}: {manifest['status']}", run)
        yield f"<pre>{html.escape(str(manifest.get('error') or ''))}</pre>"
        return
    yield _heading(headline(run.metrics, manifest), run)
    yield _table((), key_figures(run.metrics, manifest))
    yield _replay(run) or _picture(run)


def _replay(*runs: Run) -> str:
    """The replay of one run or two; nothing where one has not kept its recording, which would have
    to be run again, or where it is too large for a notebook's file."""
    if not all(run.has(POSES) for run in runs):
        return ""
    from desim.api import recording_of
    from desim.report.replay.page import page_of

    text = page_of([recording_of(run) for run in runs])
    if len(text) > _MOST_BYTES:
        return ""
    # What a frame's scripts do stays in it.
    return (f'<iframe sandbox="allow-scripts" style="width:100%;height:{_HEIGHT_PX}px;border:0" '
            f'srcdoc="{html.escape(text)}"></iframe>')


def _picture(run: Run) -> str:
    """The figure of a run, inside of the page."""
    from desim.report.run_figure import png

    data = base64.b64encode(png(run, _DPI)).decode()
    return (f'<img alt="{html.escape(headline(run.metrics, run.manifest))}" '
            f'src="data:image/png;base64,{data}">')


def _campaign(campaign: Campaign) -> Iterable[str]:
    from desim.report.campaign.numbers import Estimates, Study
    from desim.report.campaign.tables.overview import all_metrics
    from desim.report.campaign.tables.table import text_of

    design, status = campaign.design, campaign.runs["status"].tolist()
    done, failed = (status.count(word.value) for word in (RunStatus.FINISHED, RunStatus.FAILED))
    yield _heading(f"{design.name}: {done} runs" + (f", {failed} failed" if failed else ""),
                   campaign)
    if design.question:
        yield f"<p>{html.escape(design.question)}</p>"
    study = Study(campaign.path, design)
    table, _ = all_metrics(study, Estimates(study))
    presented = [name for name in design.report.metrics if name in study.metrics]
    shown = len(study.axes) + 2 + len(presented)  # vector, ..., runs, ...
    yield _table(table.head[:shown], ([text_of(cell) for cell in row[:shown]]
                                      for row in table.rows[:_MOST_ROWS]))
    more = len(table.rows) - _MOST_ROWS
    rest = f"; {more} more vectors" if more > 0 else ""
    yield (f"<p>Mean ± half of the 95 % interval{rest}. All metrics: <code>desim report "
           f"{html.escape(str(campaign.path))}</code></p>")


def _compared(found: ComparedRuns | ComparedCampaigns) -> Iterable[str]:
    first, second = map(html.escape, (str(found.first.path), str(found.second.path)))
    yield f"<p>first: <code>{first}</code><br>second: <code>{second}</code></p>"
    yield _table(("key", "first", "second"), key_rows(found.keys))
    if isinstance(found, ComparedRuns):
        unlike = [pair for pair in found.metrics if not pair.is_equal]
        yield _table(("metric", "first", "second", "difference", "%"),
                     ((pair.name, *metric_cells(pair)) for pair in unlike))
        yield f"<p>{html.escape(outcome(found))}.</p>"
        if not found.failed:
            yield _replay(found.first, found.second)
        return
    yield _table((*found.parameters, "mean of", "first", "second", "difference", "%"),
                 ((*map(value, pair.levels.values()), metric, *metric_cells(pair.metric))
                  for metric in found.reported for pair in found.pairs(metric)))


def _heading(text: str, thing: Run | Campaign) -> str:
    return (f"<p><strong>{html.escape(text)}</strong><br>"
            f"<code>{html.escape(str(thing.path))}</code></p>")


def _table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A table; nothing where it has no rows."""
    body = "".join("<tr>" + "".join(f"<td{_LEFT}>{html.escape(cell)}</td>" for cell in row)
                   + "</tr>" for row in rows)
    titles = "".join(f"<th{_LEFT}>{html.escape(title)}</th>" for title in head)
    top = f"<thead><tr>{titles}</tr></thead>" if titles else ""
    return f"<table>{top}<tbody>{body}</tbody></table>" if body else ""
