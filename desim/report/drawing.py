"""The settings that pictures are drawn with."""

from __future__ import annotations

import warnings
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import TYPE_CHECKING

from matplotlib import rc_context, rcdefaults, rcParams

if TYPE_CHECKING:  # the name is new in matplotlib 3.10
    from matplotlib.typing import RcKeyType


@contextmanager
def drawing(settings: Mapping[RcKeyType, object]) -> Iterator[None]:
    """Give all figures that are made and saved inside these settings of matplotlib, and for the
    rest its defaults: a ``matplotlibrc`` in the current folder, which anybody may have made, could
    start LaTeX. A label with $ is text. Letters that matplotlib's font lacks are boxes in PNG and
    PDF; SVG and the page show them."""
    with rc_context(), warnings.catch_warnings():
        rcdefaults()
        rcParams.update({**settings, "text.parse_math": False})
        warnings.filterwarnings("ignore", r"Glyph .* missing from font")
        yield
