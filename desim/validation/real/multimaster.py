"""multimaster: rosmaster, master_discovery, master_sync and rospy beside our model of them."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from statistics import mean
from typing import NamedTuple

from desim.units import NS_PER_S
from desim.validation.laboratory import LabNode
from desim.validation.real import ros1
from desim.validation.real.cell import FROM_BEGIN_S, Act, Attach, Cell, Played
from desim.validation.real.figures import (
    JudgedQuantity,
    arrived,
    frames,
    heard_again,
    kilobytes,
)
from desim.validation.real.judge import JudgedRow, Need
from desim.validation.real.lab_hosts import attached
from desim.validation.real.media import JudgedMedium, cut, lan, radio
from desim.validation.real.tcp import GUEST

_TOPIC = "/chat"
_SIZE_BYTES, _RATE_HZ = 200, 5
# When they start: heartbeats of one instant would collide on a radio.
_DISCOVERY_S, _SYNC_S, _NODES_S = {"talker": 3.0, "hearer": 3.3}, 5.0, 8.0
_HOSTS = {"talker": (0.0, 0.0), "hearer": (20.0, 0.0)}
# Both as our presets of these names.
_HEARTBEATS = {"fkie_1_3": "", "fkie_1_3_groovy": " _heartbeat_hz:=2 _timeout_factor:=1.4"}
_MODULES = "fkie_master_discovery.master_discovery, fkie_master_sync.master_sync"
NEEDS = (*ros1.NEEDS, Need(
    "multimaster_fkie for /usr/bin/python3", ["/usr/bin/python3", "-c", f"import {_MODULES}"],
    "let PYTHONPATH name a folder with fkie_master_discovery, fkie_master_sync and the generated "
    "fkie_multimaster_msgs; apt-get install python3-netifaces python3-diagnostic-msgs"))


class MasterTalk(NamedTuple):
    """Two hosts with a master each, whose heartbeats are those of ``preset``; a talker on one and a
    hearer on the other. ``talks``: whether the talker ever does. ``until_s``: the end of a cut."""

    what: str
    network: JudgedMedium
    preset: str
    seconds: int
    runs: int
    talks: bool = True
    since_s: float = FROM_BEGIN_S
    until_s: float = 0.0


_CUT = cut(40.03, 60.03, "*_talker")
ROWS = tuple(row for number, preset in enumerate(_HEARTBEATS) for row in (
    MasterTalk("at rest for 60 s", lan("2 ms"), preset, 90, 1, False, 30.03),
    MasterTalk("cut for 20 s", lan("2 ms", _CUT), preset, 100, 4, until_s=60.03),
    MasterTalk("cut for 20 s, radio", radio(number, _CUT), preset, 100, 1, until_s=60.03),
))


def rows() -> Iterator[JudgedRow]:
    """All rows of multimaster."""
    for number, row in enumerate(ROWS):
        yield _judged_row(row, f"mm{number}")


def _judged_row(row: MasterTalk, name: str) -> JudgedRow:
    quantities = [frames(), kilobytes()]
    if row.talks:
        quantities += [_first(), arrived()]
    if row.until_s:
        quantities.append(heard_again(row.until_s))
    return JudgedRow(f"multimaster, {row.preset}, {row.what}", [
        _cell(row, f"{name}{chr(ord('a') + k)}") for k in range(row.runs)], quantities)


def _cell(row: MasterTalk, name: str) -> Cell:
    rate_hz = _RATE_HZ if row.talks else 1 / (10 * row.seconds)
    nodes = {"talker": f"talk talker {_TOPIC} {_SIZE_BYTES} {rate_hz}",
             "hearer": f"hear hearer {_TOPIC}"}
    acts = [act for part, node in nodes.items() for act in _acts(row, f"{name}_{part}", part, node)]
    return Cell(name, row.network, _HOSTS, acts, row.seconds,
                {"model": "multimaster", "client": "rospy", "preset": row.preset,
                 "tcp": {"constants": GUEST}, "constants": {"start_jitter": "0 ns"}},
                _attached(row), _DISCOVERY_S, row.since_s)


def _acts(row: MasterTalk, host: str, part: str, node: str) -> Iterator[Act]:
    env = {"ROS_MASTER_URI": f"http://{host}:11311"}
    yield Act(part, "rosmaster --core", 0.5, env)
    for module, options, at_s in (("fkie_master_discovery", _HEARTBEATS[row.preset],
                                   _DISCOVERY_S[part]),
                                  ("fkie_master_sync", "", _SYNC_S)):
        yield Act(part, f"/usr/bin/python3 -c 'import {module}; {module}.main()'{options}", at_s,
                  env)
    yield Act(part, f"/usr/bin/python3 ros_node.py {node}", _NODES_S, env)


def _attached(row: MasterTalk) -> Attach:
    def speak(node: LabNode) -> None:
        node.publishes(_TOPIC, _SIZE_BYTES, _RATE_HZ if row.talks else 0, queue=10)

    def listen(node: LabNode) -> None:
        node.listens(_TOPIC, 2000)

    return attached({part: _after(_NODES_S - start_s, begin) for (part, start_s), begin in zip(
        _DISCOVERY_S.items(), (speak, listen), strict=True)})


def _after(wait_s: float, begin: Callable[[LabNode], object]) -> Callable[[LabNode], object]:
    return lambda node: node.after(round(wait_s * NS_PER_S), begin, node)


def _first() -> JudgedQuantity:
    """The time from the start of the nodes to the first message."""
    def of(played: Sequence[Played]) -> float:
        return mean(min((heard.at_s for heard in one.heard), default=float("nan"))
                    for one in played) - _NODES_S
    return JudgedQuantity("first message", "s after the start of nodes", of)
