"""Tables as pandas' data frames; pandas is imported when one is asked for."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from desim.errors import extra

if TYPE_CHECKING:
    import pandas


def data_frame(columns: Mapping[str, np.ndarray]) -> pandas.DataFrame:
    """The columns as a data frame. Raises ``InputError`` where pandas is not installed."""
    with extra("notebook", "to_pandas()"):
        import pandas
    return pandas.DataFrame(columns)
