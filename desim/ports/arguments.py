"""Checks of the arguments that plug-ins pass to their context. Each raises ``ModelError``."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from inspect import signature
from typing import TypeGuard

import numpy as np

from desim.errors import ModelError, class_of, did_you_mean
from desim.ports.computers import KEPT, QUANTITIES
from desim.ports.sharing import Contribution
from desim.ports.strategies import Frontier, Mark, Place, Pose2D, Strategy

_TOPIC = re.compile(r"[A-Za-z]\w*(/\w+)*", re.ASCII)  # as ROS names are
_NUMBERS = float, int, np.floating
SHORTEST_NS = 1_000_000
MOST_TIMERS = 10_000  # of a strategy on one host; those that come with desim have three at most


def check_topic(topic: object, queue: object) -> None:
    """A name below the host's, and a number of messages that may wait."""
    if not (isinstance(topic, str) and _TOPIC.fullmatch(topic)):
        raise ModelError(f"a topic is called as ROS names are, 'bid' or 'bid/best', not {topic!r}")
    if type(queue) is not int or queue < 0:
        raise ModelError(f"a queue is an int >= 0 of messages (0: no bound), not {queue!r}")


def check_callback(callback: Callable[..., object], *arguments: str) -> None:
    """A function of ``arguments``."""
    if not callable(callback):
        raise ModelError(f"a callback is a function of ({', '.join(arguments)}), not {callback!r}")
    try:
        taken = signature(callback)
    except (TypeError, ValueError):  # of a built-in function
        return
    try:
        taken.bind(*arguments)
    except TypeError:
        name = getattr(callback, "__qualname__", repr(callback))
        raise ModelError(f"a callback takes ({', '.join(arguments)}); {name} takes {taken}"
                         ) from None


def check_sources(sources: Collection[str] | None, team: Collection[str]) -> None:
    """Hosts of the team, whose messages are wanted."""
    for name in sources or ():
        if name not in team:
            raise ModelError(f"sources are hosts of the team, not {name!r}"
                             f"{did_you_mean(name, team)}; the team: {', '.join(team)}")


def check_period(period_ns: object) -> None:
    """A period of 1 ms or more."""
    if type(period_ns) is not int or period_ns < SHORTEST_NS:
        raise ModelError(f"a timer's period is an int >= {SHORTEST_NS} of ns (1 ms), not "
                         f"{period_ns!r}")


def check_work(who: str, quantities: Mapping[str, int]) -> None:
    """Quantities of work by their names."""
    _check_quantities(who, "worked", quantities, QUANTITIES)


def check_kept(who: str, quantities: Mapping[str, int]) -> None:
    """Quantities that are kept in memory, by their names."""
    _check_quantities(who, "keeps", quantities, KEPT)


def _check_quantities(who: str, does: str, quantities: Mapping[str, int],
                      known: Mapping[str, str]) -> None:
    for name, count in quantities.items():
        if name not in known:
            raise ModelError(f"{who} {does} {name}={count!r}{did_you_mean(name, known)}; "
                             f"known: {', '.join(known)}")
        if type(count) is not int or count < 0:
            raise ModelError(f"{who} {does} {name}={count!r}; a quantity is an int >= 0")


def name_of(callback: Callable[..., object]) -> str:
    """The name of a plug-in's timer for cost models: that of its function, without underscores in
    front, or ``timer`` where it has none."""
    name = getattr(callback, "__name__", "timer").strip("_")
    return name if name.isidentifier() else "timer"


def check_delay(delay_ns: object, waiting: int) -> None:
    """A time from now on, for one more timer beside those that are ``waiting``."""
    if type(delay_ns) is not int or delay_ns < 0:
        raise ModelError(f"a timer's delay is an int >= 0 of ns, not {delay_ns!r}")
    check_timers(waiting)


def check_timers(waiting: int) -> None:
    """Room for one more timer beside those that are ``waiting``."""
    if waiting >= MOST_TIMERS:
        raise ModelError(f"{MOST_TIMERS} timers of this strategy wait on this host: do they set "
                         "more than one new timer each?")


def check_advertised(topic: str, advertised: Collection[str]) -> None:
    """A topic that is advertised."""
    if topic not in advertised:
        raise ModelError(f"topic {topic!r} is published but not advertised; advertised: "
                         f"{', '.join(map(repr, sorted(advertised))) or 'nothing'}")


def check_content(content: object) -> None:
    """A content with a size."""
    size_bytes = getattr(content, "size_bytes", None)
    if type(size_bytes) is not int or size_bytes < 0:
        if hasattr(content, "size_bytes"):
            raise ModelError(f"size_bytes of a content is an int >= 0, not {size_bytes!r}")
        raise ModelError(f"a content has size_bytes, an int >= 0; {content!r} has none")


def is_pose(pose: object) -> TypeGuard[Pose2D]:
    """Whether ``pose`` is a ``Pose2D`` of finite numbers."""
    if not isinstance(pose, Pose2D):
        return False
    for number in pose:
        if not isinstance(number, _NUMBERS) or not math.isfinite(number):
            return False
    return True


def check_contribution(one: object, sources: Collection[str]) -> None:
    """News of one of ``sources``; its evidence is not looked at."""
    if not isinstance(one, Contribution):
        raise ModelError(f"a robot takes in Contributions, not {one!r}")
    source, version, pose, _ = one
    if source not in sources:
        raise ModelError(f"a Contribution comes from a robot that maps are shared with, not from "
                         f"{source!r}{did_you_mean(str(source), sources)}")
    if type(version) is not int:
        raise ModelError(f"a Contribution's version is an int, the clock of {source} in ns, not "
                         f"{version!r}")
    if pose is not None and not is_pose(pose):
        raise ModelError(f"a Contribution's pose is a Pose2D of three finite numbers, or None, not "
                         f"{pose!r}")


def check_frame(source: object, frame: object, team: Collection[str]) -> None:
    """The place of a teammate's frame, or None."""
    if source not in team:
        raise ModelError(f"frames are those of robots that maps are shared with, not of {source!r}"
                         f"{did_you_mean(str(source), team)}")
    if frame is not None and not is_pose(frame):
        raise ModelError(f"a frame lies at a Pose2D of three finite numbers, or None, not "
                         f"{frame!r}")


def check_new_topic(topic: str, advertised: Collection[str]) -> None:
    """A topic that is not advertised yet."""
    if topic in advertised:
        raise ModelError(f"topic {topic!r} is advertised a second time")


def is_place(place: object) -> bool:
    """Whether it begins with two finite numbers."""
    if not isinstance(place, tuple) or len(place) < 2:
        return False
    x_m, y_m = place[:2]
    return (isinstance(x_m, float | int) and isinstance(y_m, float | int)
            and math.isfinite(x_m) and math.isfinite(y_m))


def check_goal(place: object) -> None:
    """A place to drive to."""
    if not is_place(place):
        raise ModelError(f"a robot drives to a place of two finite numbers, not to {place!r}")


def checked_places(places: Sequence[Sequence[float]]) -> list[tuple[float, float]]:
    """The places alone, of what may have more numbers behind: frontiers, poses, rows of arrays."""
    try:
        found = [(float(place[0]), float(place[1])) for place in places]
    except (TypeError, ValueError, LookupError):
        found = [(math.nan, math.nan)]
    if not all(math.isfinite(x_m) and math.isfinite(y_m) for x_m, y_m in found):
        raise ModelError(f"places are pairs of finite numbers, x and y in m, not {places!r}")
    return found


def checked_velocities(*velocities: float) -> list[float]:
    """Velocities forward and to the left, m/s, and of turning, rad/s: finite numbers."""
    if not all(isinstance(one, _NUMBERS) and math.isfinite(one) for one in velocities):
        raise ModelError(f"a robot drives at three finite velocities, not at {velocities!r}")
    return [float(one) for one in velocities]


def checked_place(place: Sequence[float]) -> tuple[float, float]:
    """The place alone, as ``checked_places``."""
    try:
        return checked_places([place])[0]
    except ModelError:
        raise ModelError(f"a place is a pair of finite numbers, x and y in m, not {place!r}"
                         ) from None


def check_limit(limit: object) -> None:
    """A number of frontiers, or None for all."""
    if limit is not None and (type(limit) is not int or limit < 1):
        raise ModelError(f"a limit is an int >= 1 of frontiers, or None, not {limit!r}")


def start_of_ways(origin: Sequence[float] | None, pose: Pose2D | None, has_body: bool
                  ) -> tuple[float, float]:
    """``origin``, or the robot's place."""
    if origin is not None:
        return checked_place(origin)
    if pose is None:
        raise ModelError("ways begin somewhere: this host has no pose"
                         + (" yet" if has_body else "; give an origin"))
    return pose.x_m, pose.y_m


def checked_marks(marks: Iterable[tuple[float, float, str]]) -> list[Mark]:
    """The marks to show: two finite numbers and a text each."""
    found = []
    for mark in marks:
        if not (is_place(mark) and len(mark) == 3 and isinstance(mark[2], str)):  # noqa: PLR2004
            raise ModelError(f"a mark is two finite numbers and a text, not {mark!r}")
        found.append(Mark(*mark))
    return found


def check_body(host: str, has_body: bool) -> None:
    """A host that can drive."""
    if not has_body:
        raise ModelError(f"{host} has no body that could drive")


def check_choice(strategy: Strategy, chosen: object, shown: Sequence[Frontier],
                 is_on_map: Callable[[float, float], bool]) -> None:
    """A strategy's choice: a frontier that it was just ``shown``, a place on the robot's map, or
    None."""
    if not (chosen is None or isinstance(chosen, Frontier) and chosen in shown
            or isinstance(chosen, Place) and is_place(chosen) and is_on_map(*chosen)):
        what = f"a list of {len(chosen)}" if isinstance(chosen, list) else repr(chosen)
        raise ModelError(f"{class_of(strategy)} chose {what}; wanted: one of frontiers(), a Place "
                         "on the robot's map, or None")
