"""DDS domains: the hosts in each, and their ports (RTPS 2.3, 9.6.1.1: PB, DG, PG, d0, d3)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from desim.errors import InputError
from desim.ports.scope import matching

PORT_BASE, DOMAIN_GAIN, PARTICIPANT_GAIN = 7400, 250, 2
LAST_OFFSET = 11  # d3: of the last of the two ports that the first participant of a host takes
MOST_PORT = 65_535
MOST_DOMAIN = (MOST_PORT - PORT_BASE) // DOMAIN_GAIN


def multicast_port(domain: int) -> int:
    """The port of announcements, in the group 239.255.0.1 of every domain."""
    return PORT_BASE + DOMAIN_GAIN * domain


def last_port(domain: int, participants: int) -> int:
    """The last port that so many participants of one host take."""
    return multicast_port(domain) + LAST_OFFSET + PARTICIPANT_GAIN * (participants - 1)


def domains_of(hosts: Sequence[str], domain: int, domains: Mapping[str, int]) -> list[int]:
    """The domain of each host: that of the first pattern that fits, else ``domain``. Raises
    ``InputError`` for a pattern that fits none."""
    found = [domain] * len(hosts)
    for pattern, own in reversed(list(domains.items())):
        for host in matching(pattern, tuple(hosts), f".domains.{pattern}"):
            found[host] = own
    return found


def check_ports(domains: Sequence[int], participants: int) -> None:
    """Raise ``InputError`` where ``participants`` of one host need ports that there are not, or
    those of another domain that hosts are in."""
    for domain in sorted({*domains}):
        end = multicast_port(domain + 1) if domain + 1 in domains else MOST_PORT + 1
        port = last_port(domain, participants)
        if port >= end:
            most = (end - 1 - LAST_OFFSET - multicast_port(domain)) // PARTICIPANT_GAIN + 1
            why = ("a port of another domain" if end <= MOST_PORT
                   else f"and the last one is {MOST_PORT}")
            raise InputError(f".participants: {participants} of a host in domain {domain} take "
                             f"ports up to {port}, {why}; allowed there: at most {most}")
