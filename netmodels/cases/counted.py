"""The radio of the cases: it tells how often was transmitted, and may have other slots."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from netmodels.radio import Radio

SAME_POWER = {"model": "fixed", "total": "66.0206 dB"}  # everybody is heard with -50 dBm


class CountedRadio(Radio):
    """``Radio`` with keywords as in a scenario; ``slot_ns`` instead of the standard's."""

    def __init__(self, slot_ns: int | None = None, **params: Any) -> None:
        super().__init__(Radio.Params(**params))
        if slot_ns is not None:
            self._standard = replace(self._standard, slot_ns=slot_ns)

    def attempts(self) -> tuple[int, int]:
        """Transmissions of data so far, and how many of them had no reply."""
        now_ns = self._context.now_ns
        if self._settled_ns != now_ns:
            self._settle(now_ns)
        counts = self._stations.counts(now_ns)
        return int(counts.transmitted.sum()), int(counts.failures.sum())
