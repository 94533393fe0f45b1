"""Checks of the arguments that plug-ins pass to their context. Each raises ``ModelError``."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from inspect import signature

from desim.errors import ModelError, did_you_mean
from desim.ports.computers import QUANTITIES

_TOPIC = re.compile(r"[A-Za-z]\w*(/\w+)*", re.ASCII)  # as ROS names are
SHORTEST_NS = 1_000_000


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


def check_period(period_ns: object) -> None:
    """A period of 1 ms or more."""
    if type(period_ns) is not int or period_ns < SHORTEST_NS:
        raise ModelError(f"a timer's period is an int >= {SHORTEST_NS} of ns (1 ms), not "
                         f"{period_ns!r}")


def check_work(who: str, quantities: Mapping[str, int]) -> None:
    """Quantities of work by their names."""
    for name, count in quantities.items():
        if name not in QUANTITIES:
            raise ModelError(f"{who} worked {name}={count!r}{did_you_mean(name, QUANTITIES)}; "
                             f"known: {', '.join(QUANTITIES)}")
        if type(count) is not int or count < 0:
            raise ModelError(f"{who} worked {name}={count!r}; a quantity is an int >= 0")


def name_of(callback: Callable[..., object]) -> str:
    """The name of a plug-in's timer for cost models: that of its function, without underscores in
    front, or ``timer`` where it has none."""
    name = getattr(callback, "__name__", "timer").strip("_")
    return name if name.isidentifier() else "timer"
