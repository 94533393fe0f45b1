"""Numbers, intervals and titles as text."""

from __future__ import annotations

import hashlib
import math
import re
from collections.abc import Sequence

# Endings of metrics' names, with what an axis says.
_UNITS = {"_s": "s", "_m": "m", "_m2": "m²", "_kBps": "kB/s", "_bytes": "B", "_m2_per_m": "m²/m",
          "_bps": "b/s", "_percent": "%", "_mb": "MB"}
_LONGEST = 80  # letters of a file's name, before its ending
_PLAIN = re.compile(r"[a-zA-Z0-9_-]{1,80}")
_WORDS = {"cpu": "CPU", "ram": "RAM", "rx": "received", "tx": "sent"}  # of names, as on an axis


def number(value: float | None, digits: int = 4) -> str:
    """A number with that many significant digits; a long dash for None and NaN."""
    if value is None or not math.isfinite(value):
        return "–"
    if value == 0:
        return "0"
    if 1e-4 <= abs(value) < 1e7:
        decimals = max(0, digits - 1 - math.floor(math.log10(abs(value))))
        text = f"{value:,.{decimals}f}".replace(",", " ")  # as ISO 80000-1 has it
        return text.rstrip("0").rstrip(".") if "." in text else text
    return f"{value:.{digits - 1}g}"


def at_least(mean: float | None, late: int, digits: int = 4) -> str:
    """The text of a mean, with a sign where ``late`` values are only known to exceed the limit."""
    text = number(mean, digits)
    return f"≥ {text}" if late and text != "–" else text


def between(low: float | None, high: float | None) -> str:
    """The text of an interval."""
    return "–" if low is None or high is None else f"[{number(low)}, {number(high)}]"


def probability(p: float | None) -> str:
    """The text of a p value."""
    if p is None:
        return "–"
    return "< 0.001" if p < 0.001 else f"{p:.3f}"


def counted(count: int, one: str, many: str | None = None) -> str:
    """A number with its noun: ``1 run``, ``2 runs``."""
    return f"{number(count, 9)} {one if count == 1 else many or one + 's'}"


def listed(words: Sequence[str], most: int = 12) -> str:
    """The words as a list, ``a, b and c``, shortened."""
    if len(words) > most:
        words = [*words[:most], f"{len(words) - most} more"]
    return " and ".join(filter(None, [", ".join(words[:-1]), words[-1]])) if words else "none"


def titled(metric: str) -> str:
    """The title of a metric: ``exploration time [s]``, ``resync delay, mean [s]``."""
    for fold in ("mean", "max", "end"):
        if metric.endswith(tuple(f"{ending}_{fold}" for ending in _UNITS)):
            name, bracket, unit = titled(metric.removesuffix(f"_{fold}")).partition(" [")
            return f"{name}, {fold}{bracket}{unit}"
    for ending in sorted(_UNITS, key=len, reverse=True):
        if metric.endswith(ending):
            return f"{_words(metric.removesuffix(ending))} [{_UNITS[ending]}]"
    return _words(metric)


def plain(name: str) -> str:
    """A name as files and anchors may be called: a metric's may have been made up by anybody, and
    one by topic has slashes. Names of letters, digits, ``_`` and ``-`` stay."""
    if _PLAIN.fullmatch(name):
        return name
    digest = hashlib.sha256(name.encode(errors="surrogatepass")).hexdigest()[:8]
    return f"{re.sub(r'[^a-zA-Z0-9_-]+', '_', name)[:_LONGEST]}_{digest}"


def _words(name: str) -> str:
    return " ".join(_WORDS.get(word, word) for word in name.split("_"))


def quantity(value: float, unit: str) -> str:
    """A value with its unit: ``3.2 Mb/s`` of 3.2e6 b/s; other units as they are."""
    if unit == "b/s":
        for factor, prefix in ((1e9, "G"), (1e6, "M"), (1e3, "k")):
            if abs(value) >= factor:
                return f"{number(value / factor, 3)} {prefix}{unit}"
    return f"{number(value, 3)} {unit}".strip()
