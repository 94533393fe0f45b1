"""Links between hosts, as a trace or a survey has them."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Protocol

from pydantic import Field

from desim import ports
from desim.errors import InputError, did_you_mean
from desim.units import Duration
from netmodels.link_traces import LinkTraces, Surveys, read


class TraceFile(ports.Params):
    """A file with measured links, and its relation to a run."""

    file: ports.File = Field(description="the trace, relative to the scenario that names it")
    nodes: dict[str, str | int] = Field({}, description="by host, its name in the trace (its own)")
    channel: int | None = Field(None, description="rows of this one alone (all)")
    begin_ns: Duration = Field("0 s", description="the moment of the trace at which the run "
                                                  "begins (its beginning)")


class Measured(Protocol):
    """Measured links, the values of one ``column``."""

    @property
    def column(self) -> str: ...

    def values(self, source: int, receiver: int, now_ns: int) -> tuple[float, ...]:
        """Values of the column that count alike; none where nothing is known."""


def measured(params: TraceFile, columns: Sequence[str], hosts: tuple[str, ...],
             context: ports.RuleContext) -> Measured:
    """The links in a file: the values of the first of ``columns`` that it has."""
    try:
        trace = read(params.file, columns, params.channel)
    except InputError as error:
        raise InputError(f".file: {error}") from None
    if isinstance(trace, LinkTraces):
        return ByTime(trace, hosts, params.nodes, params.begin_ns)
    if params.begin_ns:
        raise InputError(".begin: a survey is of places, and has no times")
    return ByPlace(trace, hosts, params.nodes, context)


class ByTime:
    """The values of a trace: the newest row of a link, of each channel."""

    def __init__(self, trace: LinkTraces, hosts: tuple[str, ...], nodes: dict[str, str | int],
                 begin_ns: int) -> None:
        names = {node for link in trace.links for node in link}
        host_of = _hosts_by_node(hosts, nodes, names)
        self.column, self._begin_ns = trace.column, begin_ns
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
                 context: ports.RuleContext) -> None:
        host_of = _hosts_by_node(hosts, nodes, set(surveys.nodes))
        self._surveys = {host_of[node]: survey for node, survey in surveys.nodes.items()
                         if node in host_of}
        self.column, self._context = surveys.column, context
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
