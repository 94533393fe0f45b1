"""The explored share over time, of the runs whose folders are there."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from matplotlib.figure import Figure

from desim.errors import InputError
from desim.report.campaign.figures import layout
from desim.report.campaign.figures.style import WIDTH_IN, colour
from desim.report.campaign.numbers import Panel, Study, VectorRuns
from desim.report.campaign.numbers.lines import evenly
from desim.results.run import Run
from desim.results.samples import measured

_MOST_LINES = 6  # in a panel
_MOST_PANELS = 4
_MOST_RUNS = 30  # read of a vector
_INSTANTS = 121  # points of a curve, which spans half of the page
_DASHES = ("-", (0, (6, 1.5)), (0, (4, 1.5, 1, 1.5)), (0, (2, 1.2)), (0, (1, 1)), "-")



def explored_figure(study: Study, panels: list[Panel]) -> Figure | None:
    """A figure with a panel for each line of the metrics' figures, and in it some of its vectors.
    None if no run's folder is left."""
    parts = [(panel.place(line), evenly(line.vectors, _MOST_LINES))
             for panel in panels for line in panel.lines][:_MOST_PANELS]
    series = [(title, [(vector, list(_read(study, vector))) for vector in vectors])
              for title, vectors in parts]
    longest_s = max((time_s[-1] for _, vectors in series for _, runs in vectors
                     for time_s, _ in runs), default=0.0)
    if not longest_s:
        return None
    instants_s = np.linspace(0.0, longest_s, _INSTANTS)
    figure, all_axes = layout.paneled(len(series))
    figure.set_size_inches(WIDTH_IN, figure.get_figheight() + 0.3)
    for axes, (title, vectors) in zip(all_axes, series, strict=True):
        for i, (vector, runs) in enumerate(vectors):
            if runs:
                # A run that has ended keeps its last share.
                low, median, high = np.quantile([np.interp(instants_s, *run) for run in runs],
                                                [0.25, 0.5, 0.75], axis=0)
                axes.fill_between(instants_s, low, high, color=colour(i), alpha=0.2, linewidth=0)
                axes.plot(instants_s, median, color=colour(i), linewidth=1.5,
                          linestyle=_DASHES[i % len(_DASHES)],
                          label=study.label(vector, study.against) if study.against else "")
        axes.set(xlabel="simulated time [s]", xlim=(0.0, longest_s), ylim=(0.0, 103.0),
                 title=title)
    keys = {line.get_label(): line for axes in all_axes for line in axes.get_lines()}
    layout.finish(figure, all_axes, [], "explored share [%]",
                   list(keys.values()) if len(keys) > 1 else [])
    return figure



def _read(study: Study, vector: VectorRuns) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Times [s] and explored shares [%] of a vector's finished runs."""
    ids = study.text("run_id")
    for row in vector.rows[~study.failed[vector.rows]][:_MOST_RUNS]:
        try:
            samples = Run(study.run_folders[ids[row]]).table("samples", ("time_s", "explored"))
        except (KeyError, InputError):  # gone, or damaged: it is left out, and counted
            continue
        times_s, shares = measured(samples, "explored")
        if len(times_s):
            yield times_s, 100.0 * shares

