"""The group ``middleware``: all sections, one after another."""

from __future__ import annotations

from collections.abc import Iterator

from desim.ports.cases import Check, Play
from desim.validation import dds, multimaster, ros1, tcp, udp, zenoh


class MiddlewareAsMeasured:
    """The behaviour of real middleware between network namespaces that an Ethernet switch joins."""

    source = ("measured in November 2026, Linux 6.18: ROS 1 (roscpp, rospy 1.15.15), "
              "multimaster_fkie 1.3.2, Cyclone DDS 11.0.1, Fast DDS 2.9.1, Zenoh 1.10.2")

    def checks(self, play: Play) -> Iterator[Check]:
        for section in (udp, tcp, dds, multimaster, ros1, zenoh):
            yield from section.checks()
