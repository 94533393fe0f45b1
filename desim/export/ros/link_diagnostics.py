"""The log of links as ROS diagnostics: a status a link, in each second in which it has news.

A status before them has the sums over all links, for plots.
"""

from __future__ import annotations

from collections.abc import Iterator

from desim.export.link_loads import LinkLoad, LinkLoads, changes
from desim.export.ros.message_times import seconds
from desim.export.ros.message_types import DIAGNOSTIC_ARRAY, Message, RosTypes, Timed
from desim.results.source import ReplaySource

STATUS = "diagnostic_msgs/msg/DiagnosticStatus"
NETWORK, LINK = "network", "link: "  # a status's name, and the beginning of one
_OK, _WARN, _STALE = 0, 1, 3
_NS_PER_MS = 1_000_000


def link_log(recording: ReplaySource, loads: LinkLoads, types: RosTypes) -> Iterator[Timed]:
    """Each second the links that carried messages or have changed. A status is a warning where
    messages were dropped, and stale where frames do not get through any more."""
    agenda = list(changes(recording))
    linked: dict[tuple[str, str], bool] = {}
    for second, time_ns in seconds(recording):
        news: dict[tuple[str, str], LinkLoad] = {}
        while agenda and agenda[0].time_ns <= time_ns:
            change = agenda.pop(0)
            pair = change.host, change.other
            linked[pair] = change.linked
            if change.time_ns >= recording.begin_ns:
                news[pair] = LinkLoad(*pair, 0, 0, 0.0, 0)
        for load in loads.at(second):
            news[load.source, load.destination] = load
        yield time_ns, types.make(DIAGNOSTIC_ARRAY, header=types.header(time_ns, ""), status=[
            _network(types, list(news.values()), sum(linked.values())),
            *(_status(types, load, linked.get(pair)) for pair, load in news.items())])


def _network(types: RosTypes, loads: list[LinkLoad], links: int) -> Message:
    """The sums over all links."""
    messages, size_bytes, dropped = (sum(getattr(load, name) for load in loads)
                                     for name in ("messages", "size_bytes", "dropped"))
    return types.make(STATUS, level=_WARN if dropped else _OK, name=NETWORK,
                      message=f"{messages} messages, {dropped} dropped", values=_pairs(types, {
                          "messages": str(messages), "bytes": str(size_bytes),
                          "dropped": str(dropped), "links": str(links)}))


def _status(types: RosTypes, load: LinkLoad, linked: bool | None) -> Message:
    """``linked`` None: the run has not sampled links."""
    level, text = _OK, f"{load.messages} messages"
    if load.dropped:
        level, text = _WARN, f"{load.messages} messages, {load.dropped} dropped"
    if linked is False:
        level, text = _STALE, "out of reach"
    values = {"host": load.source, "other": load.destination, "messages": str(load.messages),
              "bytes": str(load.size_bytes), "dropped": str(load.dropped)}
    if linked is not None:
        values["linked"] = str(linked).lower()
    if load.messages:
        values["latency_ms"] = f"{load.latency_ns / _NS_PER_MS:.6f}"
    return types.make(STATUS, level=level, message=text, hardware_id=load.source,
                      name=f"{LINK}{load.source} to {load.destination}",
                      values=_pairs(types, values))


def _pairs(types: RosTypes, values: dict[str, str]) -> list[Message]:
    return [types.make("diagnostic_msgs/msg/KeyValue", key=key, value=value)
            for key, value in values.items()]
