"""The speed of people by their density, beside Weidmann's curve (1993)."""

import math

import numpy as np
import pytest

from desim.engine.streams import Streams
from desim.scenario.schema.environment import People, Shape
from desim.world import sources
from desim.world.people import Crowd

RADIUS_M, BREADTH_M, CORNERS = 10.0, 3.0, 48  # of a ring
DT_S, BEGIN_S, END_S = 1.0 / 60.0, 10.0, 20.0


def ring(radius_m):
    angles = np.arange(CORNERS + 1) % CORNERS * math.tau / CORNERS
    return [(f"{radius_m * math.cos(a)} m", f"{radius_m * math.sin(a)} m") for a in angles]


def speed_mps(density, together=True):
    """The mean speed along a ring of people at this density per m2, or each alone there."""
    walls = [{"from": one, "to": other, "thickness": "0 m"} for radius_m in (
        RADIUS_M - BREADTH_M / 2, RADIUS_M + BREADTH_M / 2)
        for one, other in zip(ring(radius_m), ring(radius_m)[1:], strict=False)]
    terrain = sources.load(Shape(size=("26 m", "26 m"), walls=walls))
    count = round(density * math.tau * RADIUS_M * BREADTH_M)
    group = People(count=count if together else 1, path=ring(RADIUS_M),
                   width=f"{BREADTH_M - 0.6} m")
    crowds = [Crowd([group], terrain, np.zeros((0, 3)), Streams(seed))
              for seed in range(1 if together else 40)]
    found = []
    for crowd in crowds:
        for tick in range(round(END_S / DT_S)):
            crowd.advance(DT_S, np.zeros((0, 3)), np.zeros((0, 4)))
            if tick * DT_S >= BEGIN_S and tick % 30 == 0:
                people = crowd.walkers
                tangents = np.column_stack((-people.places[:, 1], people.places[:, 0]))
                tangents /= np.hypot(*tangents.T)[:, None]
                found.append((people.velocities * tangents).sum(axis=1).mean())
    return float(np.mean(found))


def weidmann_mps(density):
    """Weidmann, Transporttechnik der Fussgaenger, 1993: 1.34 (1 - exp(-1.913 (1/D - 1/5.4)))."""
    return 1.34 * (1.0 - math.exp(-1.913 * (1.0 / density - 1.0 / 5.4)))


@pytest.mark.parametrize("density", [0.25, 0.5, 1.0, 1.5, 2.0])
def test_speed_by_density(density):
    """The model as published is 0.18 to 0.31 m/s slower (docs/validation.md)."""
    assert speed_mps(density) == pytest.approx(weidmann_mps(density), abs=0.35)


def test_people_who_do_not_feel_each_other_are_too_fast():
    """Twin: at 2 people a m2, each alone."""
    assert abs(speed_mps(2.0, together=False) - weidmann_mps(2.0)) > 0.6
