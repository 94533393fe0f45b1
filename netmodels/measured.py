"""Links between hosts, as a trace or a survey has them."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Protocol

from desim import ports
from desim.errors import InputError, did_you_mean
from netmodels.link_traces import LinkTraces, Surveys


class Measured(Protocol):
    """Measured links."""

    def values(self, source: int, receiver: int, now_ns: int) -> tuple[float, ...]:
        """Delivery ratios or RSSI in dBm that count alike; none where nothing is known."""


class ByTime:
    """The values of a trace: the newest row of a link, of each channel."""

    def __init__(self, trace: LinkTraces, hosts: tuple[str, ...], nodes: dict[str, str | int],
                 begin_ns: int) -> None:
        names = {node for link in trace.links for node in link}
        host_of = _hosts_by_node(hosts, nodes, names)
        self._begin_ns = begin_ns
        self._links = {(host_of[source], host_of[destination]): link
                       for (source, destination), link in trace.links.items()
                       if source in host_of and destination in host_of}
        if not self._links:
            raise InputError(f".nodes: the trace has no link between two hosts{_there(names)}; "
                             f"hosts are {', '.join(hosts)}")

    def values(self, source: int, receiver: int, now_ns: int) -> tuple[float, ...]:
        link = self._links.get((source, receiver))
        return link.at(now_ns + self._begin_ns) if link else ()


class ByPlace:
    """The values of a survey, of hosts that are its nodes: those of the place of the other end, in
    both directions; between two nodes, the source's."""

    def __init__(self, surveys: Surveys, hosts: tuple[str, ...], nodes: dict[str, str | int],
                 context: ports.Context) -> None:
        host_of = _hosts_by_node(hosts, nodes, set(surveys.nodes))
        self._surveys = {host_of[node]: survey for node, survey in surveys.nodes.items()
                         if node in host_of}
        self._context = context
        if not self._surveys:
            raise InputError(f".nodes: no host is a node of the survey{_there(surveys.nodes)}; "
                             f"hosts are {', '.join(hosts)}")

    def values(self, source: int, receiver: int, now_ns: int) -> tuple[float, ...]:
        node, other = (source, receiver) if source in self._surveys else (receiver, source)
        survey = self._surveys.get(node)
        return () if survey is None else survey.at(self._context.positions(now_ns)[other])


def _hosts_by_node(hosts: tuple[str, ...], nodes: dict[str, str | int], known: set[str]
                   ) -> dict[str, int]:
    """Hosts by the names that they have in the file, their own unless ``nodes`` has another. Raises
    ``InputError`` for names that do not fit."""
    host_of: dict[str, int] = {}
    for host, name in nodes.items():
        if host not in hosts:
            raise InputError(f".nodes: no host {host!r}{did_you_mean(host, hosts)}; hosts are "
                             f"{', '.join(hosts)}")
        if str(name) not in known:
            raise InputError(f".nodes.{host}: the trace has no node {str(name)!r}{_there(known)}")
    for index, host in enumerate(hosts):
        node = str(nodes.get(host, host))
        if node in host_of:
            raise InputError(f".nodes.{host}: node {node!r} is host {hosts[host_of[node]]!r} "
                             "already")
        host_of[node] = index
    return host_of


def _there(nodes: Iterable[str]) -> str:
    return f"; it has {', '.join(sorted(nodes, key=ports.natural_key))}"
