"""A small fleet to which everything happens, under each middleware.

As a program it prints the digests of some of these runs: python fleets.py
"""

from __future__ import annotations

import json
import sys

from runs import HELLO, built

# Four robots and a base. The base (the master, the server, everybody's router) restarts; robot_3
# dies; robot_2 restarts; for a while the fleet is in two halves. A packet in a hundred is lost.
FLEET = (
    "deployment=field", "fleet.size=4", "hosts.base={at: [-10 m, 8 m], monitor: true}",
    "network.media={lan: null, air: {model: disk, range: 60 m, rules: ["
    "{rule: partition, groups: [[robot_0, robot_3, base]], from: 8 s, until: 23 s}, "
    "{rule: loss, probability: 1 %}]}}",
    "faults=[{at: 10 s, host: base, down_for: 6 s}, {at: 12 s, host: robot_3}, "
    "{at: 14 s, host: robot_2, down_for: 5 s}]",
    "stop={by: all, explored: 100 %, elapsed: 60 s}",
)
_CHOICES = {
    "direct": "model: direct",
    "roscpp, master on the base": "model: ros1, master: base",
    "rospy, master on a robot": "model: ros1, client: rospy, master: robot_2",
    "multimaster, groovy": "model: multimaster, preset: fkie_1_3_groovy",
    "multimaster, noetic": "model: multimaster, preset: fkie_1_3",
    "fastdds": "model: dds",
    "cyclonedds": "model: dds, preset: cyclonedds",
    "fastdds, server": "model: dds, discovery: server, server: base",
    "cyclonedds, server": "model: dds, preset: cyclonedds, discovery: server, server: base",
    "zenoh": "model: zenoh, preset: zenoh",
    "rmw_zenoh": "model: zenoh",
    "rmw_zenoh_2024": "model: zenoh, preset: rmw_zenoh_2024",
    "zenoh, connect": "model: zenoh, preset: zenoh, discovery: connect, connect: [base]",
    "zenoh, mesh": "model: zenoh, preset: zenoh, discovery: connect, connect: [robot_0, robot_1], "
                   "gossip: true",
    "zenoh, one router": "model: zenoh, preset: zenoh, discovery: connect, connect: [base], "
                         "routers: [base]",
}
CASES = {name: (HELLO, *FLEET, f"middleware={{{choice}}}") for name, choice in _CHOICES.items()}
CASES["fastdds, broadcast"] = (*CASES["fastdds"], "coordination.exchange.via=broadcast")
# One of each middleware, with most of its parts: these are played in another process, too.
AGAIN = ("direct", "rospy, master on a robot", "multimaster, noetic", "fastdds",
         "cyclonedds, server", "zenoh, mesh")


if __name__ == "__main__":
    json.dump({name: built(*CASES[name]).run().digest for name in AGAIN}, sys.stdout)
