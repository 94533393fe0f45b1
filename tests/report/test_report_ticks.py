"""Logarithmic axes of figures whose labels are text, not TeX."""

import pytest
from matplotlib import rc_context
from matplotlib.figure import Figure

from desim.report.log_axis import plain


def ticks(scale, low, high, formatted=plain, **parameters):
    with rc_context({"text.parse_math": False}):
        axes = Figure().add_subplot()
        axes.set_yscale(scale, **parameters)
        axes.set_ylim(low, high)
        formatted(axes.yaxis)
        axes.figure.draw_without_rendering()
        return [label.get_text() for label in axes.get_yticklabels(which="both")]


@pytest.mark.parametrize("scale, low, high, shown, parameters", [
    ("log", 2e-6, 50.0, {"0.001", "0.1", "10"}, {}),
    ("log", 120.0, 800.0, {"200", "300", "400", "600"}, {}),  # less than a decade: numbers between
    ("symlog", 0.0, 300.0, {"0", "0.1", "1", "10", "100"}, {"linthresh": 0.1}),
])
def test_they_are_plain_numbers(scale, low, high, shown, parameters):
    said = set(ticks(scale, low, high, **parameters)) - {""}
    assert shown <= said
    assert all(float(text) or text == "0" for text in said)


def test_without_it_they_are_tex():
    assert any("mathdefault" in text for text in ticks("log", 1e-6, 50.0, lambda axis: None))
