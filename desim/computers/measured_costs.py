"""Measured processor times of robot software, in picoseconds at speed 1.

FIRST VALUES. One of them is measured (gmapping); the others are estimates, to be replaced. Speed 1
is a core of the virtual machine of 2 cores on which gmapping was measured.
"""

from __future__ import annotations

from collections.abc import Mapping

from desim.computers.costs.linear import ANY, CallbackCost, MessageCost

_US = 10**6  # ps
_MS = 10**9

# openslam gmapping, 30 particles, 361 beams, 5 cm cells, MIT CSAIL: 295 ms of processor time a
# processed scan, about 10 ms a particle: 27.2 us a beam and particle.
_GMAPPING_BEAM_PS = 295 * _MS // (30 * 361)

CALLBACKS: Mapping[str, Mapping[str, CallbackCost]] = {
    "slam": {"odom": CallbackCost(20 * _US, {"beams": _GMAPPING_BEAM_PS})},  # fixed: estimate
    "localization": {ANY: CallbackCost(20 * _US)},  # estimate
    "mapping": {ANY: CallbackCost(20 * _US, {"beams": 5 * _US})},  # estimate
    "map_sharing": {ANY: CallbackCost(20 * _US, {"cells": 5000})},  # estimate
    "move_base": {  # estimates
        "control": CallbackCost(100 * _US, {"candidates": 20 * _US, "cells": 50_000}),
        "observe": CallbackCost(100 * _US, {"beams": 1 * _US}),
        ANY: CallbackCost(50 * _US, {"cells": 50_000}),
    },
    "explore": {ANY: CallbackCost(100 * _US, {"cells": 50_000})},  # estimate
    "monitor_feed": {ANY: CallbackCost(50 * _US, {"cells": 5000})},  # estimate
}
SEND = MessageCost(message_ps=10 * _US, byte_ps=300, link_ps=10 * _US, link_byte_ps=200)  # estimate
RECEIVE = MessageCost(message_ps=15 * _US, byte_ps=500)  # estimate
