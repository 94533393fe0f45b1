"""The style of figures: colours for colour-blind readers too, symbols, one ink for the rest."""

from __future__ import annotations

import html
import re
from pathlib import Path
from typing import TYPE_CHECKING

from matplotlib.figure import Figure

from desim import colours

if TYPE_CHECKING:  # the name is new in matplotlib 3.10
    from matplotlib.typing import RcKeyType

PALETTE = colours.LINES
MARKERS = ("o", "s", "D", "^", "v", "P", "X", "p")
INK = "#16181d"
WIDTH_IN = 7.4
_GRID_ALPHA = 0.15
RC: dict[RcKeyType, object] = {
       "font.size": 9.5, "axes.titlesize": 10, "axes.labelsize": 9.5, "legend.fontsize": 8.5,
       "xtick.labelsize": 8.5, "ytick.labelsize": 8.5, "font.family": "sans-serif",
       "text.color": INK, "axes.edgecolor": INK, "axes.labelcolor": INK, "xtick.color": INK,
       "ytick.color": INK, "grid.color": INK, "grid.alpha": _GRID_ALPHA, "grid.linewidth": 0.6,
       "axes.spines.top": False, "axes.spines.right": False, "axes.linewidth": 0.7,
       "axes.facecolor": "none",
       "axes.grid": True, "axes.axisbelow": True, "legend.frameon": False, "axes.titlelocation":
       "left",
       "svg.fonttype": "none", "svg.hashsalt": "desim", "pdf.fonttype": 42}
_UNDATED = {"svg": {"Date": None}, "pdf": {"CreationDate": None}, "png": {}}


def colour(style: int) -> str:
    """The colour of a line."""
    return PALETTE[style % len(PALETTE)]


def marker(style: int) -> str:
    """The symbol of a line. When the colours repeat, the symbol changes."""
    return MARKERS[(style + style // len(PALETTE)) % len(MARKERS)]


def save(figure: Figure, folder: Path, name: str, title: str) -> str:
    """Write ``name``.png, .svg and .pdf, always the same bytes for the same figure. Returns the
    figure for the page; screen readers read out its ``title``."""
    if engine := figure.get_layout_engine():
        engine.execute(figure)
    figure.set_layout_engine("none")  # laid out once, not once a format
    for ending, metadata in _UNDATED.items():
        figure.savefig(folder / f"{name}.{ending}", dpi=160, metadata=metadata,
                       facecolor="none" if ending == "svg" else "white")
    return _inline((folder / f"{name}.svg").read_text("utf-8"), name, title)


def _inline(svg: str, name: str, title: str) -> str:
    """SVG that takes its ink and its colours, light or dark, from the page."""
    svg = svg[svg.index("<svg"):]
    svg = re.sub(r"<metadata>.*?</metadata>", "", svg, flags=re.S)
    svg = re.sub(r' xmlns(:\w+)?="[^"]*"', "", svg)
    svg = svg.replace("xlink:href", "href")
    svg = svg.replace("<svg", f'<svg role="img" aria-labelledby="{name}-title"', 1)
    svg = svg.replace(">", f'><title id="title">{html.escape(title)}</title>', 1)
    # Every figure of the page has its own names.
    svg = re.sub(r'\bid="', f'id="{name}-', svg)
    svg = re.sub(r'(href="#|url\(#)', rf"\g<1>{name}-", svg)
    svg = re.sub(r"font: ([^;\"]*?)(\d[\d.]*px) [^;\"]*", r"font: \1\2 var(--sans)", svg)
    svg = svg.replace(INK, "currentColor")
    for i, shade in enumerate(PALETTE):
        svg = svg.replace(shade, f"var(--series-{i})")
    return svg
