"""For a while the network falls into parts."""

from __future__ import annotations

from fnmatch import fnmatchcase

from pydantic import Field

from desim import ports
from desim.errors import InputError, did_you_mean
from desim.units import Duration


class Partition:
    """From ``from`` to ``until`` hosts reach only those of their own group. Hosts that no pattern
    names are one more group."""

    class Params(ports.Params):
        groups: list[list[str]] = Field(min_length=1, description="host names or patterns with * "
                                                                  "and ?, group by group")
        start_ns: Duration = Field("0 ns", alias="from", description="(the beginning)")
        until_ns: Duration | None = Field(None, description="null: for good")

    reasons = ("partitioned",)

    def __init__(self, params: Params) -> None:
        self._params = params

    def start(self, context: ports.Context, hosts: tuple[str, ...]) -> None:
        self._context = context
        groups = self._params.groups
        for pattern in (pattern for group in groups for pattern in group):
            if not any(fnmatchcase(host, pattern) for host in hosts):
                raise InputError(f"partition: {pattern!r} names no host"
                                 f"{did_you_mean(pattern, hosts)}; hosts are {', '.join(hosts)}")
        self._group = [_group_of(host, groups) for host in hosts]

    def judge(self, frame: ports.Frame, receivers: tuple[int, ...]) -> list[ports.Verdict] | None:
        if not self._holds():
            return None
        own = self._group[frame.source]
        return [ports.PASS if self._group[receiver] == own else ports.Drop("partitioned")
                for receiver in receivers]

    def separates(self, host: int, other: int) -> bool:
        """Whether no frame gets between the two now."""
        return self._holds() and self._group[host] != self._group[other]

    def _holds(self) -> bool:
        now_ns, until_ns = self._context.now_ns, self._params.until_ns
        return self._params.start_ns <= now_ns and (until_ns is None or now_ns < until_ns)


def _group_of(host: str, groups: list[list[str]]) -> int:
    """Number of the group that names ``host``, -1 for none; ``InputError`` if two do."""
    found = [number for number, group in enumerate(groups)
             if any(fnmatchcase(host, pattern) for pattern in group)]
    if len(found) > 1:
        raise InputError(f"partition: host {host!r} is in more than one group")
    return found[0] if found else -1
