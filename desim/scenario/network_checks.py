"""The checks of a scenario's media, and of the traffic that it declares."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from fnmatch import fnmatchcase

from desim import plugins
from desim.errors import InputError
from desim.ports import ChecksHosts
from desim.scenario import plugin_choices
from desim.scenario.checks import Checks, Found
from desim.scenario.complaints import Complaint, validated
from desim.scenario.complete import media
from desim.scenario.names import host_names, robot_names, unknown
from desim.scenario.recipients import listeners, monitors, words_of
from desim.scenario.robot_types import equipment_by_path
from desim.scenario.schema.communication import MediumChoice
from desim.scenario.schema.robot import OTHERS, OWN_TOPICS, Publication
from desim.scenario.schema.scenario import Scenario
from desim.scenario.source_places import Folder, Path, path_of
from desim.units import DURATION, MESSAGE_SIZE


def _attached(scenario: Scenario, _: Folder) -> Found:
    own = scenario.network.media
    hosts = host_names(scenario) if any(choice.hosts for choice in own.values()) else ()
    for medium, choice in own.items():
        path: Path = ("network", "media", medium, "hosts")
        for i, name in enumerate(choice.hosts or ()):
            if name not in hosts:
                yield (*path, i), unknown("host", name, hosts)
        yield from _repeated(path, choice.hosts or ())
        if choice.hosts is not None and len(choice.hosts) < (1 if choice.inside else 2):
            yield path, ("must be at least one host, or left out" if choice.inside else
                         f"must be a list of at least 2, got a list of {len(choice.hosts)}")


def unfit(scenario: Scenario) -> Iterator[Complaint]:
    """The parameters of media that do not fit together, or to the hosts, as their models would say
    when a run starts; for a complete scenario without other faults."""
    hosts = (*host_names(scenario), *scenario.network.others)
    for name, choice in scenario.network.media.items():
        if not isinstance(choice.params, ChecksHosts):
            continue
        try:
            choice.params.check_hosts(hosts)
        except InputError as error:
            for line in map(str, error.args):
                key, _, text = line.partition(": ")
                yield Complaint(("network", "media", name, *path_of(key[1:])), text)


def _topics(scenario: Scenario, _: Folder) -> Found:
    known = tuple(media(scenario))
    for pattern, choice in scenario.topics.items():
        path: Path = ("topics", pattern, "medium")
        if not choice.media and not choice.dscp:
            yield path, f"must name at least one medium; allowed: {', '.join(known)}"
        for i, name in enumerate(choice.media):
            if name not in known:
                yield (path if isinstance(choice.medium, str) else (*path, i)), unknown(
                    "medium", name, known)
        yield from _repeated(path, choice.media)


def _forwarding(scenario: Scenario, _: Folder) -> Found:
    own = media(scenario)
    for host, stationary in scenario.hosts.items():
        path: Path = ("hosts", host, "forwards")
        if len(stationary.forwards) == 1:
            yield path, "must be at least two media, or none"
        for i, name in enumerate(stationary.forwards):
            if name not in own or own[name].inside:
                yield (*path, i), unknown("medium", name, _outside(own))
            elif host not in (own[name].hosts or (host,)):
                yield (*path, i), f"{host} is not attached to {name} (network.media.{name}.hosts)"
        yield from _repeated(path, stationary.forwards)


def _repeated(path: Path, names: Sequence[str]) -> Found:
    """Names that a list has already."""
    for i, name in enumerate(names):
        if name in names[:i]:
            yield (*path, i), f"{name} is named already; allowed: once"


def _outside(own: dict[str, MediumChoice]) -> tuple[str, ...]:
    """The names of media between hosts."""
    return tuple(name for name, medium in own.items() if not medium.inside)


def _others(scenario: Scenario, _: Folder) -> Found:
    if not scenario.network.others and not scenario.network.background:
        return
    others, hosts = scenario.network.others, host_names(scenario)
    robots, own = robot_names(scenario), media(scenario)
    for name in others:
        if name in hosts:
            yield ("network", "others", name), f"{name!r} is the name of another host"
    for i, flow in enumerate(scenario.network.background):
        path: Path = ("network", "background", i)
        source, receiver = flow.between
        if flow.medium not in own or own[flow.medium].inside:
            yield (*path, "medium"), unknown("medium", flow.medium, _outside(own))
        elif receiver in hosts and receiver not in (own[flow.medium].hosts or hosts):
            yield (*path, "between", 1), (f"{receiver} is not attached to {flow.medium} "
                                          f"(network.media.{flow.medium}.hosts)")
        if flow.until_ns is not None and flow.until_ns <= flow.start_ns:
            yield (*path, "until"), (f"must be later than from, got "
                                     f"{DURATION.format(flow.start_ns)} to "
                                     f"{DURATION.format(flow.until_ns)}")
        if source not in others:
            yield (*path, "between", 0), (
                unknown("host of others", source, tuple(others)) if others else
                f"{source!r} is not one of network.others, of which there are none")
        if receiver in robots:
            yield (*path, "between", 1), (f"{receiver!r} is a robot, whose traffic is the fleet's "
                                          "(robot.publishes)")
        elif receiver not in others and receiver not in hosts:
            allowed = (*others, *(host for host in hosts if host not in robots))
            yield (*path, "between", 1), unknown("host", receiver, allowed)
        elif receiver == source:
            yield (*path, "between"), f"must be two hosts, got {source!r} twice"


def _fidelity(scenario: Scenario, _: Folder) -> Found:
    path, fidelity = ("network", "fidelity"), scenario.network.fidelity
    if fidelity is None:
        return
    chosen = media(scenario)
    try:
        rungs = [medium for medium in chosen.values() if plugin_choices.has_fidelity(medium)]
    except InputError:
        return  # there is no such model, which is complained of where it is named
    if not rungs:
        models = ", ".join(f"{name} is a {medium.model}" for name, medium in chosen.items())
        yield path, (f"no medium has one to choose: {models}; allowed with a model that has a "
                     "parameter fidelity, as radio has")
    for medium in rungs:
        result = validated(plugins.parameters("network", medium.model),
                           {**medium.written, "fidelity": fidelity})
        if isinstance(result, list):
            yield from ((path, complaint.text) for complaint in result
                        if complaint.path == ("fidelity",))


def _publications(scenario: Scenario, _: Folder) -> Found:
    for path, equipment in equipment_by_path(scenario):
        topics = [publication.topic for publication in equipment.publishes]
        for i, publication in enumerate(equipment.publishes):
            at: Path = (*path, "publishes", i)
            topic = publication.topic
            copied = topic.partition("/copy_")[0]  # see testbed.processes
            if copied.rpartition("/")[2] in OWN_TOPICS or topic.startswith("strategy/"):
                yield (*at, "topic"), f"{topic!r} is a topic of the robot's own; choose another"
            elif topic in topics[:i]:
                yield (*at, "topic"), f"{topic!r} is published already, by another of this list"
            yield from _receivers(at, publication, scenario)


def _published_maps(scenario: Scenario, _: Folder) -> Found:
    """Whole maps that no message can hold: each cell is a byte."""
    cells = scenario.robot.mapping.published_cells
    if cells > MESSAGE_SIZE.maximum:
        yield ("robot", "mapping", "published_size"), (
            f"makes maps of {cells:.3g} cells, a byte each; allowed: "
            f"{MESSAGE_SIZE.format(MESSAGE_SIZE.maximum)}")


def _receivers(at: Path, publication: Publication, scenario: Scenario) -> Found:
    """Words of ``to`` that mean nobody."""
    if publication.to == ():
        yield (*at, "to"), "must name at least one host, or be left out"
    elif publication.to is None and not monitors(scenario):
        yield at, ("the key 'to' is missing: its default are the hosts that collect maps and "
                   "distances, and there is none (hosts.<name>.monitor)")
    hosts = listeners(scenario)
    for i, word in enumerate(words_of(publication)):
        if word != OTHERS and not any(fnmatchcase(host, word) for host in hosts):
            yield (*at, "to") if isinstance(publication.to, str) else (*at, "to", i), (
                unknown("host", word, (OTHERS, *hosts)))


CHECKS: Checks = (
    ((("network", "media"), ("fleet",), ("hosts",), ("deployment",)), _attached),
    ((("network",), ("deployment",)), _fidelity),
    ((("network",), ("fleet",), ("hosts",), ("deployment",)), _others),
    ((("topics",), ("network",), ("deployment",)), _topics),
    ((("hosts",), ("network",), ("deployment",)), _forwarding),
    ((("robot", "publishes"), ("robot", "passive"), ("fleet",), ("hosts",), ("deployment",)),
     _publications),
    ((("robot", "mapping"),), _published_maps),
)
