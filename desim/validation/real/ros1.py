"""ROS 1: rosmaster and rospy beside our model of them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from statistics import mean
from typing import NamedTuple

from desim.middleware.contents import Filler
from desim.validation.laboratory import LabNode
from desim.validation.real.cell import DRIVE, Act, Attach, Cell, Place, Played
from desim.validation.real.figures import (
    JudgedQuantity,
    arrived,
    delay,
    frames,
    heard_again,
    kilobytes,
    mean_delay,
    silence,
)
from desim.validation.real.judge import JudgedRow, Need
from desim.validation.real.lab_hosts import attached
from desim.validation.real.media import JudgedMedium, cut, lan, lost, radio, weak_radio
from desim.validation.real.tcp import GUEST

_TOPIC = "/p3dx0/map"
_TALKER_S, _FIRST_HEARER_S, _NEXT_S = 3.0, 6.03, 0.51  # when nodes start

NEEDS = tuple(Need(f"{module} for /usr/bin/python3", ["/usr/bin/python3", "-c", f"import {module}"],
                   f"apt-get install {package}") for module, package in (
    ("rosmaster", "python3-rosmaster"), ("rospy", "python3-rospy"),
    ("nav_msgs.msg", "python3-nav-msgs")))


class RosTalk(NamedTuple):
    """A master, a talker and ``hearers``, each on a host of its own; the place of the first of
    them. ``rate_hz`` 0: one latched message."""

    what: str
    network: JudgedMedium
    size_bytes: int
    rate_hz: int
    hearers: int
    seconds: int
    runs: int = 1
    until_s: float = 0.0  # the end of a cut
    hearer: Place = (0.0, 10.0)


_CUT = cut(15.03, 21.03, "*_talker")
ROWS = (
    RosTalk("a latched map of 300 B, 2 ms", lan("2 ms"), 300, 0, 1, 12, 4),
    RosTalk("a latched map of 300 B, 20 ms", lan("20 ms"), 300, 0, 1, 12, 4),
    RosTalk("a latched map of 160 kB, radio", radio(0), 160_000, 0, 1, 12),
    RosTalk("800 B at 20 Hz to one, radio", radio(1), 800, 20, 1, 20),
    RosTalk("800 B at 20 Hz to three, radio", radio(2), 800, 20, 3, 20),
    RosTalk("800 B at 20 Hz to three, radio, 10 % lost", radio(3, lost(0.1)), 800, 20, 3, 20),
    RosTalk("800 B at 20 Hz to one, 2 ms, 3 % lost", lan("2 ms", lost(0.03)), 800, 20, 1, 40, 3),
    RosTalk("1 kB at 10 Hz, radio, cut for 6 s", radio(4, _CUT), 1000, 10, 1, 45, 1, 21.03),
    RosTalk("1 kB at 10 Hz, 2 ms, cut for 6 s", lan("2 ms", _CUT), 1000, 10, 1, 45, 1, 21.03),
    RosTalk("1 kB at 10 Hz, to a robot that leaves the radio's range", weak_radio(5), 1000, 10, 1,
            60, hearer=DRIVE),
)


def rows() -> Iterator[JudgedRow]:
    """All rows of ROS 1."""
    for number, row in enumerate(ROWS):
        yield judged_row(row, f"ros{number}")


def judged_row(row: RosTalk, name: str) -> JudgedRow:
    """A row whose cells are called ``name`` and a letter."""
    quantities = [frames(), kilobytes(), frames("master"), kilobytes("master"), _first(),
                  arrived()]
    if row.rate_hz:
        quantities += [mean_delay(), delay(50), delay(90)]
    if row.until_s:
        quantities.append(heard_again(row.until_s))
    if row.hearer == DRIVE:
        quantities += silence()
    return JudgedRow(f"ROS 1, {row.what}", [
        _cell(row, f"{name}{chr(ord('a') + k)}") for k in range(row.runs)], quantities)


def _cell(row: RosTalk, name: str) -> Cell:
    hearers = [f"hearer_{k}" for k in range(row.hearers)]
    starts_s = {"talker": _TALKER_S, **{
        hearer: _FIRST_HEARER_S + k * _NEXT_S for k, hearer in enumerate(hearers)}}
    env = {"ROS_MASTER_URI": f"http://{name}_master:11311", "ROS_NAMESPACE": "/p3dx0"}
    acts = [Act("master", "rosmaster --core", 0.5, env),
            Act("talker", f"/usr/bin/python3 ros_node.py talk slam_gmapping {_TOPIC} "
                          f"{row.size_bytes} {row.rate_hz}", _TALKER_S, env),
            *(Act(hearer, f"/usr/bin/python3 ros_node.py hear map_merging_{hearer[-1]} {_TOPIC}",
                  starts_s[hearer], env) for hearer in hearers)]
    places = {hearer: (0.0, 10.0 + 10 * k) if k else row.hearer
              for k, hearer in enumerate(hearers)}
    return Cell(name, row.network, {"master": (0, 0), "talker": (20, 0), **places}, acts,
                row.seconds, {"model": "ros1", "client": "rospy", "master": f"{name}_master",
                              "tcp": {"constants": GUEST}}, _attached(row), starts_s)


def _attached(row: RosTalk) -> Attach:
    def speak(node: LabNode) -> None:
        if row.rate_hz:
            node.publishes(_TOPIC, row.size_bytes, row.rate_hz, queue=10)
        else:
            node.advertise(_TOPIC, latch=True)
            node.publish(_TOPIC, Filler(row.size_bytes))

    return attached({"talker": speak, **{
        f"hearer_{k}": lambda node: node.listens(_TOPIC, 2000) for k in range(row.hearers)}})


def _first() -> JudgedQuantity:
    """The time from a hearer's call to its first message."""
    def of(played: Sequence[Played]) -> float:
        return mean(min(heard.at_s for heard in one.heard if heard.host == "hearer_0")
                    - one.called_s["hearer_0"] for one in played)
    return JudgedQuantity("first message", "ms after the call", lambda played: 1e3 * of(played))
