"""The filters of both kinds of SLAM by name.

Their plug-ins, which scenarios name, are in ``desim/robot/localization/kinds``.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from desim.robot.slam.particle_filter import ParticleSlam
from desim.robot.slam.settings import SlamSettings


def gmapping(settings: SlamSettings, key: int) -> ParticleSlam:
    """A Rao-Blackwellized particle filter (Grisetti, Stachniss and Burgard 2007)."""
    return ParticleSlam(settings, key, settings.noise.spread)


def scan_matching(settings: SlamSettings, key: int) -> ParticleSlam:
    """One hypothesis: each scan goes where it fits best on the map so far (Olson 2009)."""
    return ParticleSlam(replace(settings, particles=1), key, spread=0.0)


SLAM: dict[str, Callable[[SlamSettings, int], ParticleSlam]] = {
    "gmapping": gmapping, "scan_matching": scan_matching}
