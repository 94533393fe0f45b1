"""TCP: a socket program over Linux beside our model of it."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from statistics import mean
from typing import NamedTuple

from desim.engine.kernel import Phase
from desim.middleware.tcp import Tcp, TcpParams
from desim.simulation.simulation import Simulation
from desim.units import NS_PER_S
from desim.validation.laboratory import lab_message
from desim.validation.real.cell import DRIVE, Act, Attach, Cell, Heard, Place, Played
from desim.validation.real.figures import (
    JudgedQuantity,
    arrived,
    delay,
    frames,
    heard_again,
    kilobytes,
    mean_delay,
    silence,
)
from desim.validation.real.judge import JudgedRow
from desim.validation.real.media import JudgedMedium, cut, lost, radio, weak_radio, wire

# Linux 6.1 as User-Mode Linux, CONFIG_HZ=100.
GUEST = {"tick": "10 ms", "syn_linear": 0, "piece_segments": 22}
TALKERS = "*_talker_*"
_PORT = 5555
_TAIL_S = 15  # after the last message


class LinkTalk(NamedTuple):
    """Messages over one connection, or several of equal ``pairs``: a message every ``every_ms``,
    or (0) always the next one. ``hearer``: the place of a first hearer."""

    what: str
    network: JudgedMedium
    size_bytes: int
    every_ms: int
    seconds: int
    nodelay: bool = False
    pairs: int = 1
    hearer: Place = (20.0, 0.0)


def cell_of(row: LinkTalk, name: str) -> Cell:
    """The cell of these connections."""
    acts: list[Act] = []
    parts: dict[str, Place] = {}
    for pair in range(row.pairs):
        talker, hearer = f"talker_{pair}", f"hearer_{pair}"
        parts |= {talker: (0, 3.0 * pair), hearer: (20, 3.0 * pair) if pair else row.hearer}
        acts += [Act(hearer, f"$DESIM_PYTHON tcp_link.py hear {_PORT}", 0.5),
                 Act(talker, f"$DESIM_PYTHON tcp_link.py talk {name}_{hearer} {_PORT} "
                             f"{row.size_bytes} {row.every_ms / 1000} {row.seconds} "
                             f"{int(row.nodelay)}", _start_s(pair))]
    return Cell(name, row.network, parts, acts, round(_start_s(row.pairs)) + 1 + row.seconds
                + _TAIL_S,
                {"model": "direct"}, _attached(row))


def _start_s(pair: int) -> float:
    """The instant at which the talker of a pair connects."""
    return round(1 + 0.237 * pair, 3)


def _attached(row: LinkTalk) -> Attach:
    def attach(simulation: Simulation, cell: Cell) -> Callable[[], list[Heard]]:
        tcp = Tcp(simulation.graph.context, TcpParams.model_validate({"constants": GUEST}))
        talks = [LinkTalker(simulation, cell, row, tcp, pair) for pair in range(row.pairs)]
        return lambda: [heard for talk in talks for heard in talk.heard]
    return attach


class LinkTalker:
    """The model's connection of a pair, and its talker. ``heard``: what has arrived."""

    def __init__(self, simulation: Simulation, cell: Cell, row: LinkTalk, tcp: Tcp, pair: int
                 ) -> None:
        self._kernel, self._row, self._tcp, self._pair = simulation.kernel, row, tcp, pair
        self._begin_ns = round((_start_s(pair) + 1) * NS_PER_S)
        self._end_ns = self._begin_ns + row.seconds * NS_PER_S
        graph = simulation.graph
        self._hosts = (graph.host(cell.host(f"talker_{pair}")).index,
                       graph.host(cell.host(f"hearer_{pair}")).index)
        self._tcp.listen(self._hosts[1], "link", lambda connection: None)
        self._sent_ns: list[int] = []
        self.heard: list[Heard] = []
        self._at(self._begin_ns - NS_PER_S, self._connect)

    def _at(self, time_ns: int, fn: Callable[[], object]) -> None:
        self._kernel.at(time_ns, Phase.CONTROL, 0, lambda _: fn())

    def _connect(self) -> None:
        self._sender = self._tcp.connect(
            *self._hosts, "link", "link", opened=lambda connection: None,
            closed=lambda connection, reason: None, keepalive=False,
            nodelay=self._row.nodelay).sender(self._hosts[0])
        self._at(self._begin_ns, self._talk)

    def _talk(self) -> None:
        """Write a message, which ends when all of it has room in the send buffer, as ``sendall``.
        """
        if self._kernel.now_ns < self._end_ns:
            self._sent_ns.append(self._kernel.now_ns)
            self._sender.send(self._row.size_bytes, self._arrived, lab_message(len(self._sent_ns)),
                              None)
            self._go_on()

    def _go_on(self) -> None:
        if self._sender.takes:
            due_ns = self._begin_ns + len(self._sent_ns) * self._row.every_ms * 1_000_000
            self._at(max(due_ns, self._kernel.now_ns), self._talk)
        else:
            self._sender.when_writable(self._go_on)

    def _arrived(self, _: object) -> None:
        number = len(self.heard)
        self.heard.append(Heard(f"hearer_{self._pair}", number, self._kernel.now_ns / NS_PER_S,
                                self._sent_ns[number] / NS_PER_S))


class TcpRow(NamedTuple):
    """A link that talks, on several connections with random numbers of their own."""

    talk: LinkTalk
    connections: int = 1
    cut_s: tuple[float, float] | None = None


def _cut(way_ms: float, size_bytes: int, until_s: float, connections: int) -> TcpRow:
    cut_s = (10.03, until_s)
    return TcpRow(LinkTalk(
        f"{size_bytes / 1000:g} kB at 10 Hz, {way_ms:g} ms, cut for {until_s - 10:.0f} s",
        wire(10, way_ms, cut(*cut_s, TALKERS)), size_bytes, 100, round(2 * until_s - 10), True),
        connections, cut_s)


ROWS = (
    *(TcpRow(LinkTalk(f"1 kB at 10 Hz, 20 ms, {100 * loss:g} % lost", wire(10, 20, lost(loss)),
                      1000, 100, 60, True), 6 if loss else 1) for loss in (0, 0.01, 0.03, 0.1)),
    TcpRow(LinkTalk("1 kB at 10 Hz, 20 ms, Nagle, 10 % lost", wire(10, 20, lost(0.1)),
                    1000, 100, 60), 6),
    *(TcpRow(LinkTalk(f"160 kB at 1 Hz, 20 ms, {100 * loss:g} % lost", wire(10, 20, lost(loss)),
                      160_000, 1000, 30), 4 if loss else 1) for loss in (0, 0.01, 0.03)),
    *(TcpRow(LinkTalk(f"bulk, 20 ms, {100 * loss:g} % lost", wire(10, 20, lost(loss)),
                      160_000, 0, 20), 4 if loss else 1) for loss in (0, 0.01, 0.03, 0.1)),
    TcpRow(LinkTalk("1 kB at 10 Hz, radio", radio(0), 1000, 100, 30)),
    TcpRow(LinkTalk("160 kB at 1 Hz, radio", radio(1), 160_000, 1000, 20)),
    TcpRow(LinkTalk("160 kB at 1 Hz, radio, 10 % lost", radio(2, lost(0.1)), 160_000, 1000, 20), 1),
    _cut(0.05, 1000, 16.03, 1),
    _cut(20, 1000, 16.03, 1),
    _cut(0.05, 1000, 40.03, 1),
    *(TcpRow(LinkTalk(f"1 kB at {1000 / every_ms:g} Hz, to a robot that leaves the radio's range",
                      weak_radio(3 + number), 1000, every_ms, 60, True, hearer=DRIVE))
      for number, every_ms in enumerate((100, 400))),
)


def rows() -> Iterator[JudgedRow]:
    """All rows of TCP."""
    for number, row in enumerate(ROWS):
        yield judged_row(row, f"tcp{number}")


def judged_row(row: TcpRow, name: str) -> JudgedRow:
    """A row whose connections are called ``name`` and a letter."""
    talk = row.talk
    cells = [cell_of(talk, f"{name}{chr(ord('a') + k)}") for k in range(row.connections)]
    quantities = [frames("talker"), frames("hearer"), kilobytes(), _sent_again(talk.size_bytes),
                  arrived(), mean_delay(), delay(50), delay(90)]
    if row.cut_s:
        quantities.append(heard_again(row.cut_s[1]))
    if talk.hearer == DRIVE:
        quantities += silence()
    return JudgedRow(f"TCP, {talk.what}", cells, quantities)


def _sent_again(size_bytes: int) -> JudgedQuantity:
    """The bytes that talkers have sent more than once, and what did not arrive."""
    def of(played: Sequence[Played]) -> float:
        return mean(sum(sent.payload_bytes for host, sent in one.sent.items()
                        if host.startswith("talker")) - len(one.heard) * size_bytes
                    for one in played) / 1e3
    return JudgedQuantity("sent again", "kB a run", of)
