"""A plug-in of localization on a log: real odometry and scans, no simulator."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np

from desim import plugins
from desim.engine.streams import Streams
from desim.errors import InputError, below
from desim.imports.slam_logs.laser_log import LaserLog
from desim.imports.slam_logs.log_robot import LogRobot
from desim.imports.slam_logs.slam_trial import SlamTrial, whole_path
from desim.ports.localization import Localization
from desim.robot.localization.kinds.ground_truth import GroundTruth
from desim.robot.slam.particle_filter import ParticleSlam
from desim.robot.slam.settings import SlamSettings
from desim.scenario.complaints import validated
from desim.scenario.source_places import dotted


def localization_for_logs(name: str, given: Mapping[str, object]) -> Callable[[], Localization]:
    """Makes the plug-in called ``name`` with the parameters ``given`` by key, as scenarios have
    them. Raises ``InputError`` for what is wrong with them, or cannot work on a log."""
    with below("--localization"):
        cls, block = (plugins.load("localization", name),
                      plugins.parameters("localization", name))
        if issubclass(cls, GroundTruth):
            others = [one for one in plugins.available("localization") if one != "ground_truth"]
            raise InputError(f"{plugins.bare(name)!r} reads the true pose, which is in the "
                             f"simulator alone, and in no log; allowed: {', '.join(others)}, or a "
                             "plug-in 'package.module:Class'")
    params = validated(block, dict(given))
    if isinstance(params, list):
        raise InputError(*(f"--set {dotted(wrong.path)}: {wrong.text}" if wrong.path
                           else f"--set: {wrong.text}" for wrong in params))

    def new() -> Localization:
        with below("--set"):
            return cls(params)

    return new


def play_localization(localization: Localization, log: LaserLog, settings: SlamSettings,
                      streams: Streams, clock: Callable[[], float],
                      done: Callable[[int, int], object] = lambda part, whole: None) -> SlamTrial:
    """Feed a log to a plug-in that is new; ``clock`` and ``done`` as of ``slam_trial.play``.

    The scans of the map count as processed. The CPU time of a scan in between is added to that of
    the next processed one. If the plug-in draws the map, the final path goes through its last poses
    of these scans, and those in between are aligned with the map of them, as in
    ``slam_trial.play``. Otherwise nothing is corrected afterwards, and the final path is the online
    one.
    """
    robot, scans = LogRobot(localization, settings, streams), len(log.times_s)
    online, spent_s = np.zeros((scans, 3)), np.zeros(scans)
    for k in range(scans):
        begin_s = clock()
        online[k] = robot.read(float(log.times_s[k]), log.odometry[k], log.ranges[k])
        spent_s[k] = clock() - begin_s
        done(k + 1, scans)
    nodes, processed = np.array(robot.path).reshape(-1, 3), np.zeros(scans, bool)
    processed[robot.drawn] = True
    drawer = ParticleSlam(replace(settings, particles=1), 0, 0.0)
    drawer.start_map(nodes, [*log.ranges[processed]])
    corrects = robot.draws_map and len(nodes) > 0
    path = whole_path(nodes, log, processed, drawer.locate) if corrects else online
    return SlamTrial(online, path, processed, None,
                     np.diff(np.cumsum(spent_s)[robot.drawn], prepend=0.0), None, drawer.map())
