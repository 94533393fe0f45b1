"""For a while the network falls into parts."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from desim import ports
from desim.errors import InputError
from desim.ports.scope import matching

Group = Annotated[list[str], Field(min_length=1)]


class Partition:
    """From ``from`` until ``until`` hosts reach only those of their own group. Hosts that no
    pattern names are one more group.

    Capabilities: Separates.
    """

    class Params(ports.TimeWindow):
        groups: list[Group] = Field(min_length=1, description="host names or patterns with * "
                                                                  "and ?, group by group")

    reasons = ("partitioned",)

    def __init__(self, params: Params) -> None:
        self._params = params

    def start(self, context: ports.RuleContext, hosts: tuple[str, ...]) -> None:
        self._context = context
        self._group = _group_of_each(hosts, self._params.groups)

    def judge(self, frame: ports.Frame, receivers: tuple[int, ...]) -> list[ports.Verdict] | None:
        if not self._params.holds(self._context.now_ns):
            return None
        own = self._group[frame.source]
        return [ports.PASS if self._group[receiver] == own else ports.Drop("partitioned")
                for receiver in receivers]

    def separates(self, host: int, other: int) -> bool:
        """Whether no frame gets between the two now."""
        return (self._group[host] != self._group[other]
                and self._params.holds(self._context.now_ns))


def _group_of_each(hosts: tuple[str, ...], groups: list[list[str]]) -> list[int]:
    """Host index to the number of its group, -1 for none. Raises ``InputError`` for a pattern that
    names nobody and for a host that two groups name."""
    group = [-1] * len(hosts)
    for number, patterns in enumerate(groups):
        for i, pattern in enumerate(patterns):
            path = f".groups.{number}.{i}"
            for host in matching(pattern, hosts, path):
                if group[host] not in (-1, number):
                    raise InputError(f"{path}: host {hosts[host]!r} is in more than one group")
                group[host] = number
    return group
