"""Measured processor times of robot software, in picoseconds at speed 1, and its memory.

Speed 1 is one core of an AMD EPYC 7003 (Zen 3, 2.45 GHz) in a virtual machine, gcc 12 -O2. How each
value was measured, how far it may be off, and which are estimates: docs/computers.md, section
by section in this order. A map here is that of the paper's launch files, 800 x 800 cells of 0.2 m.
"""

from __future__ import annotations

from collections.abc import Mapping

from desim.computers.costs.linear import (
    ANY,
    CallbackCost,
    MemoryTable,
    MessageCost,
    ProcessMemory,
)

_NS = 1000  # ps
_US = 10**6
_MS = 10**9

# slam_gmapping: a scan that is not matched (30 particles are moved); for each particle and beam of
# one that is (optimize, likelihoodAndScore: 143 scores of 150 ns for each of 178 usable beams of
# 191); for each particle (registration, weights, the tree of trajectories after 150 scans).
GMAPPING_SCAN = 20 * _US
GMAPPING_BEAM = 20 * _US
GMAPPING_PARTICLE = 190 * _US
# Its map (updateMap): for each scan matched so far, which it draws anew (191 beams of 8.7 m in the
# mean, 41 ns a cell of a ray), and for each cell of the map.
GMAPPING_REDRAWN_SCAN = 360 * _US
GMAPPING_REDRAWN_BEAM = GMAPPING_REDRAWN_SCAN // 191
GMAPPING_MAP_CELL = 3_200

# costmap_2d at 5 Hz: all but the rays of the global (0.2 m, 800 x 800) and the local (0.1 m, 60 x
# 60) costmap, and the rays of both for a beam; a scan that an observation buffer takes in (estimate
# in parts), for each costmap.
COSTMAPS_UPDATE = 90 * _US
COSTMAPS_BEAM = 140 * _NS
OBSERVED_SCAN = 20 * _US
SCANS_PER_UPDATE = 5  # 25 Hz over 5 Hz
# TrajectoryPlannerROS: distances to path and goal on the local map, and the transforms of plan and
# pose (50 us, an estimate); 80 velocities, rolled out for 1 s (33 poses of 400 ns in the mean). The
# planner here rates 3 x 20 of them (the others turn on the spot), so each of these has 80 / 60.
LOCAL_PLAN = 150 * _US
LOCAL_CANDIDATE = 80 * 13_300 * _NS // 60
# navfn: its arrays and costs for each cell of the map, and a way of 20 m (25 000 cells taken from
# its queue, 25 ns each).
NAVFN_CELL = 6_300
NAVFN_WAY = 25_000 * 25 * _NS

# explore, in each search for frontiers: for each cell of its map two whole potentials (2 x 45 ns),
# the search itself and the copy that it publishes; for each frontier 500 cells of 180 ns. Each
# second: its own costmap.
EXPLORE_CELL = 98 * _NS
EXPLORE_FRONTIER = 500 * 180 * _NS
EXPLORE_COSTMAP = 5 * 62 * _US + 25 * OBSERVED_SCAN

# map_merging: a call of getPublishedTopics; a byte of its reply (162 a topic, 20 topics a robot); a
# cell that is merged.
POLL_CALL = 165 * _US
POLL_BYTE = 16_700
MERGED_CELL = 2_300

# Nodes here declare the cells of an 80 m terrain, and the paper's maps are 160 m wide.
_PAPER_CELLS = 4  # for each cell that is declared
_SCANS_PER_ODOMETRY = 2.5  # 25 Hz over 10 Hz
_POLLED_ROBOT = 20 * 162 * POLL_BYTE  # for the topics of one robot

CALLBACKS: Mapping[str, Mapping[str, CallbackCost]] = {
    "slam": {
        "odom": CallbackCost(int(_SCANS_PER_ODOMETRY * GMAPPING_SCAN), {
            "beams": GMAPPING_BEAM, "particles": GMAPPING_PARTICLE}),
        ANY: CallbackCost(0, {
            "scans": GMAPPING_REDRAWN_SCAN, "cells": _PAPER_CELLS * GMAPPING_MAP_CELL}),
    },
    "mapping": {ANY: CallbackCost(0, {"beams": GMAPPING_REDRAWN_BEAM})},
    "map_sharing": {
        "loop": CallbackCost(POLL_CALL + _POLLED_ROBOT, {
            "candidates": _POLLED_ROBOT, "cells": _PAPER_CELLS * MERGED_CELL}),
        ANY: CallbackCost(0, {"cells": _PAPER_CELLS * MERGED_CELL}),
    },
    "move_base": {
        "control": CallbackCost(LOCAL_PLAN, {
            "candidates": LOCAL_CANDIDATE, "plans": NAVFN_WAY, "cells": _PAPER_CELLS * NAVFN_CELL}),
        "observe": CallbackCost(COSTMAPS_UPDATE + 2 * SCANS_PER_UPDATE * OBSERVED_SCAN,
                                {"beams": COSTMAPS_BEAM}),
        ANY: CallbackCost(0, {"plans": NAVFN_WAY, "cells": _PAPER_CELLS * NAVFN_CELL}),
    },
    "explore": {
        "watch": CallbackCost(EXPLORE_COSTMAP, {
            "cells": _PAPER_CELLS * EXPLORE_CELL, "candidates": EXPLORE_FRONTIER}),
        ANY: CallbackCost(0, {
            "cells": _PAPER_CELLS * EXPLORE_CELL, "candidates": EXPLORE_FRONTIER}),
    },
}
# roscpp over Ethernet of 1500 B: it serializes a message once, and writes it to each link; over
# loopback a byte costs 0.1 ns a link to write, and 0.37 ns to read.
SEND = MessageCost(message_ps=85 * _US, byte_ps=200, link_ps=13 * _US, link_byte_ps=900)
RECEIVE = MessageCost(message_ps=75 * _US, byte_ps=1150)

# Memory, bytes. Resident pages of files, which all processes of roscpp have in common, and what
# each has to itself; likewise of rospy.
ROSCPP_FILES = 11_300_000
ROSCPP_PROCESS = 1_200_000
ROSPY_FILES = 11_000_000
ROSPY_PROCESS = 23_500_000
# slam_gmapping: a patch of 32 x 32 cells of a particle's map, which particles share until one
# writes to it; what it keeps of a scan, with 30 trajectories.
GMAPPING_PATCH = 16_700
GMAPPING_REMEMBERED_SCAN = 29_000
# For each cell: costmap_2d, navfn's arrays, a map message.
COSTMAP_CELL = 3
NAVFN_CELL_ARRAYS = 14
MAP_MESSAGE_CELL = 1
# A planner has a copy of the costmap, and the map that it was made of.
PLANNER_CELL = 2 * COSTMAP_CELL + NAVFN_CELL_ARRAYS + MAP_MESSAGE_CELL
# map_merging: each map twice while it is copied.
MERGED_MAP_CELL = 2 * MAP_MESSAGE_CELL


def _process(cell_bytes: int = 0, **per_bytes: int) -> ProcessMemory:
    """A process of roscpp, with ``cell_bytes`` a cell of the paper's maps."""
    return ProcessMemory(ROSCPP_PROCESS, {
        "bytes": 1, "cells": _PAPER_CELLS * cell_bytes, **per_bytes})


# Besides its nodes, a computer runs two static_transform_publishers and roslaunch. Other nodes here
# are parts of programs, or programs that were not measured: only their messages that wait count.
MEMORY = MemoryTable(ROSCPP_FILES + 2 * ROSCPP_PROCESS + ROSPY_FILES + ROSPY_PROCESS, {
    "slam": _process(MAP_MESSAGE_CELL, patches=GMAPPING_PATCH, scans=GMAPPING_REMEMBERED_SCAN),
    "localization": _process(),
    "mapping": _process(MAP_MESSAGE_CELL),
    "pose_publisher": _process(),
    "map_sharing": _process(MERGED_MAP_CELL),
    "move_base": _process(PLANNER_CELL),
    "explore": _process(PLANNER_CELL),
    "coordinate": _process(PLANNER_CELL),
    ANY: ProcessMemory(0, {"bytes": 1}),
})
