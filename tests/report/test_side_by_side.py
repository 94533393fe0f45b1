"""The cells of two runs side by side; a metric that a run lacks is a dash."""

import pytest

from desim.report.side_by_side import metric_cells
from desim.results.comparison import MetricPair


@pytest.mark.parametrize(("first", "second", "cells"), [
    (None, 60, ("-", "60", "", "")),  # of an imported run, messages_delivered
    (None, None, ("-", "-", "", "")),
    (0, 60, ("0", "60", "+60", "")),
    (40, 60, ("40", "60", "+20", "+50.0")),
    (2.0, 1.5, ("2", "1.5", "-0.5", "-25.0")),
    ("elapsed", "explored", ("elapsed", "explored", "", "")),
])
def test_both_values_their_difference_and_its_share(first, second, cells):
    assert metric_cells(MetricPair("messages_delivered", first, second)) == cells
