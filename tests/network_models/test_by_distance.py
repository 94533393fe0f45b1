"""The script of the bandwidth study: what it counts where."""

import importlib.util
from types import SimpleNamespace

import numpy as np
import pytest


def column(*values):
    return np.array(values, dtype=object if isinstance(values[0], str) else float)


@pytest.fixture
def script(repository):
    path = repository / "scenarios" / "studies" / "by_distance.py"
    spec = importlib.util.spec_from_file_location("by_distance", path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_distance_is_that_of_the_instant_of_publishing(script):
    robots = {"robot": column("a", "b", "a", "b"), "time_s": column(0, 0, 1, 1),
              "x_m": column(0, 3, 0, 3), "y_m": column(0, 4, 0, 8)}
    sent = {"source": column("a", "a", "b", "a"), "destination": column("b", "b", "a", "base"),
            "born_ns": column(0, 0.5e9, 1e9, 0), "latency_ns": column(2e9, np.nan, 1e9, 1e9),
            "fate": column("delivered", "dropped", "delivered", "delivered")}
    found = script.messages_of(SimpleNamespace(robots=robots, table=lambda name: sent))
    np.testing.assert_allclose(found, [(0, 5, 1, 2), (0.5, np.hypot(3, 6), 0, np.nan),
                                       (1, np.hypot(3, 8), 1, 1)])
    assert script.row("all", found, of=4) == "| all | 75 % | 67 % | 1.5 s |"
