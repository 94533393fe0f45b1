"""Peers: rows in which hosts of one middleware find each other and talk, DDS or Zenoh."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import NamedTuple

from desim.middleware.contents import Filler
from desim.units import NS_PER_S
from desim.validation.laboratory import LabNode
from desim.validation.real.cell import DRIVE, FROM_BEGIN_S, Act, Cell, Place
from desim.validation.real.figures import (
    JudgedQuantity,
    arrived,
    delay,
    first_heard,
    frames,
    heard_again,
    kilobytes,
    mean_delay,
    silence,
)
from desim.validation.real.judge import JudgedRow
from desim.validation.real.lab_hosts import attached
from desim.validation.real.media import JudgedMedium, weak_radio

START_S = 0.5  # of the first host


class Published(NamedTuple):
    """A topic that a peer publishes. ``size_bytes``: of a message with its serialization, without
    a header. ``rate_hz`` 0: never. ``depth`` 0: all are kept. Not ``reliable``: best effort."""

    topic: str
    size_bytes: int = 0
    rate_hz: int = 0
    depth: int = 10
    reliable: bool = True


class Listened(NamedTuple):
    """A topic that a peer reads."""

    topic: str
    depth: int = 10
    reliable: bool = True


class PeerNode(NamedTuple):
    """A host with one node."""

    publishes: Sequence[Published] = ()
    listens: Sequence[Listened] = ()


def talk(size_bytes: int, rate_hz: int, readers: int = 1, depth: int = 10, reliable: bool = True
         ) -> dict[str, PeerNode]:
    """One host that publishes, and others that read."""
    return {**{f"reader_{k}": PeerNode((), [Listened("/talk", depth, reliable)])
               for k in range(readers)},
            "writer": PeerNode([Published("/talk", size_bytes, rate_hz, depth, reliable)])}


class PeerTalk(NamedTuple):
    """``peers`` that start one after another, by the names of their parts. They talk ``begin_s``
    after their start. What counts: all that is sent since ``since_s``. Of several ``participants``
    on each host, all but the first have no topics. ``places``: of those that are somewhere else."""

    what: str
    network: JudgedMedium
    peers: Mapping[str, PeerNode]
    seconds: int
    runs: int = 1
    since_s: float = FROM_BEGIN_S
    begin_s: float = 2.0
    apart_s: float = 0.05  # from one start to the next
    until_s: float = 0.0  # the end of a cut
    participants: int = 1
    own: Mapping[str, object] = {}  # the model's parameters of this row
    places: Mapping[str, Place] = {}


def leaving(number: int) -> PeerTalk:
    """A reader that leaves the range of a radio of this number, and comes back."""
    return PeerTalk("1000 B at 10 Hz, to a robot that leaves the radio's range", weak_radio(number),
                    talk(1000, 10), 70, begin_s=4.0, places={"reader_0": DRIVE})


class PeerSoftware(NamedTuple):
    """A middleware: its real program, which takes the peer's name, the time after which it talks,
    and its topics; and our model of it."""

    name: str
    run: str
    middleware: Mapping[str, object]


def judged_row(row: PeerTalk, software: PeerSoftware, name: str) -> JudgedRow:
    """A row whose cells are called ``name`` and a letter."""
    quantities = [frames(), kilobytes()]
    if any(topic.rate_hz for peer in row.peers.values() for topic in peer.publishes):
        quantities += _of_messages(row)
    return JudgedRow(f"{software.name}, {row.what}", [
        _cell(row, software, f"{name}{chr(ord('a') + k)}") for k in range(row.runs)], quantities)


def _of_messages(row: PeerTalk) -> list[JudgedQuantity]:
    if row.until_s:
        return [arrived(), heard_again(row.until_s)]
    if DRIVE in row.places.values():
        return [arrived(), *silence()]
    if not row.begin_s:
        return [first_heard()]
    return [arrived(row.since_s), mean_delay(row.since_s), delay(50, row.since_s),
            delay(90, row.since_s)]


def _cell(row: PeerTalk, software: PeerSoftware, name: str) -> Cell:
    starts_s = {part: round(START_S + k * row.apart_s, 3) for k, part in enumerate(row.peers)}
    acts = [Act(part, " ".join([software.run, part, str(row.begin_s), *_words(peer)]),
                starts_s[part]) for part, peer in row.peers.items()]
    acts += [Act(part, f"{software.run} {part}/node_{number} {row.begin_s}",
                 round(starts_s[part] + number * row.apart_s, 3))
             for part in row.peers for number in range(1, row.participants)]
    return Cell(name, row.network, {part: row.places.get(part, (20.0 * (k % 2), 10.0 * (k // 2)))
                                    for k, part in enumerate(row.peers)},
                acts, row.seconds, {**software.middleware, **row.own},
                attached({part: _life(peer, row.begin_s) for part, peer in row.peers.items()}),
                starts_s, row.since_s)


def _words(peer: PeerNode) -> list[str]:
    """The topics of a peer, as its program takes them."""
    return [*(f"{topic}:{size_bytes}:{rate_hz}:{depth}:{int(reliable)}"
              for topic, size_bytes, rate_hz, depth, reliable in peer.publishes),
            *(f"{topic}:{depth}:{int(reliable)}" for topic, depth, reliable in peer.listens)]


def _life(peer: PeerNode, begin_s: float) -> Callable[[LabNode], object]:
    def begin(node: LabNode) -> None:
        for topic in peer.publishes:
            node.publishes(topic.topic, topic.size_bytes, 0, queue=topic.depth,
                           transport="stream" if topic.reliable else "datagram")
        for heard in peer.listens:
            node.listens(heard.topic, heard.depth)
        node.after(round(begin_s * NS_PER_S), talk, node)

    def talk(node: LabNode) -> None:
        for topic in peer.publishes:
            if topic.rate_hz:
                node.timer(topic.rate_hz, partial(_publish, node, topic), start="zero")
    return begin


def _publish(node: LabNode, topic: Published, tick: int) -> None:
    node.publish(topic.topic, Filler(topic.size_bytes))
