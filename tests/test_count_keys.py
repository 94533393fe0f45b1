"""The number of keys is bounded; ``tools/count_keys.py`` counts them."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from typing import Annotated

from count_keys import Key, _of, sums  # a tool

from desim.ports import Constants, Params

TOOL = Path(__file__).resolve().parents[1] / "tools" / "count_keys.py"
