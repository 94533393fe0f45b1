"""The hosts and links that a rule acts on, by name."""

from __future__ import annotations

from fnmatch import fnmatchcase

from pydantic import Field, model_validator

from desim import ports
from desim.errors import InputError, did_you_mean


def matching(pattern: str, hosts: tuple[str, ...], path: str) -> list[int]:
    """The indices of the hosts that a name or a pattern with * and ? means. ``InputError`` at the
    parameter ``path`` if there are none."""
    found = [index for index, host in enumerate(hosts) if fnmatchcase(host, pattern)]
    if not found:
        raise InputError(f"{path}: {pattern!r} names no host{did_you_mean(pattern, hosts)}; "
                         f"hosts are {', '.join(hosts)}")
    return found


class Targets(ports.Params):
    """Hosts, with all that they send and receive, and links, in both directions."""

    hosts: list[str] = Field([], description="names or patterns with * and ? (none)")
    links: list[tuple[str, str]] = Field([], description="two of these each (none)")

    @model_validator(mode="after")
    def _names_something(self) -> Targets:
        if not self.hosts and not self.links:
            raise ValueError("hosts or links must be given")
        return self

    def resolved(self, hosts: tuple[str, ...]) -> tuple[list[int], list[tuple[int, int]]]:
        """Indices of hosts, and of the two ends of links, the smaller one first; both in order.
        Raises ``InputError`` for a pattern that names none."""
        named = {index for number, pattern in enumerate(self.hosts)
                 for index in matching(pattern, hosts, f".hosts.{number}")}
        links: dict[tuple[int, int], None] = {}
        for number, (one, other) in enumerate(self.links):
            ends = [matching(pattern, hosts, f".links.{number}.{end}")
                    for end, pattern in enumerate((one, other))]
            found = {(min(a, b), max(a, b)): None for a in ends[0] for b in ends[1] if a != b}
            if not found:
                raise InputError(f".links.{number}: {one!r} and {other!r} name one host only")
            links |= found
        return sorted(named), sorted(links)
