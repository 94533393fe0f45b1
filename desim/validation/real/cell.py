"""Cells: networks of a few hosts each, on which real programs and models play the same."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

from desim.simulation.simulation import Simulation
from desim.validation.real.media import JudgedMedium

PROGRAMS = Path(__file__).parent / "programs"
DRIVE = Path(__file__).parent / "drive.csv"  # 20 m east of the origin, out of range, and back
FROM_BEGIN_S = 0.1  # hosts of the model are up for an instant at 0, whose frames do not count
_TAP = "desim.validation.real.wire_tap:WireTap"
_STACK = "desim.validation.real.stack:Stack"


class Heard(NamedTuple):
    """A message that came to ``host``; instants in s of simulated time."""

    host: str
    number: int
    at_s: float
    born_s: float

    @property
    def late_s(self) -> float:
        """The time that it took."""
        return self.at_s - self.born_s


class SentFrames(NamedTuple):
    """The frames of one host: how many, their bytes on the medium, and those of TCP's stream."""

    frames: int = 0
    size_bytes: int = 0
    payload_bytes: int = 0


class Played(NamedTuple):
    """The outcome of a cell: what its hosts (by the name of their part) have sent and heard, and
    when (s) programs that say so made their first call."""

    sent: Mapping[str, SentFrames]
    heard: list[Heard]
    called_s: dict[str, float]


class Act(NamedTuple):
    """A real program of the host ``part``: its command line, and when it starts (s)."""

    part: str
    run: str
    at_s: float
    env: Mapping[str, str] = {}


Place = tuple[float, float] | Path  # x, y in m; or DRIVE, of a robot that drives so
Attach = Callable[[Simulation, "Cell"], Callable[[], list[Heard]]]


class Cell(NamedTuple):
    """A network with hosts of its own. ``name``: also that of its medium, whose random numbers it
    decides. ``parts``: its hosts, which are called NAME_PART; their places. ``acts``: the real
    side. ``middleware``: the model, as in a scenario, and ``attach(simulation, cell)`` lets its
    hosts do the same; it returns a function that says what was heard. ``starts_s``: when hosts of
    the model start, if not at once. ``since_s``: from when on frames are counted."""

    name: str
    medium: JudgedMedium
    parts: Mapping[str, Place]
    acts: Sequence[Act]
    seconds: int
    middleware: Mapping[str, object]
    attach: Attach
    starts_s: dict[str, float] = {}
    since_s: float = FROM_BEGIN_S

    def host(self, part: str) -> str:
        """The host's name in scenarios."""
        return f"{self.name}_{part}"


def scenario_of(cells: Sequence[Cell], seed: int, real: bool) -> dict[str, object]:
    """The scenario of ``cells``: with real programs, or of one cell with our model of them."""
    own: dict[str, object] = {} if real else {"middleware": dict(cells[0].middleware), "faults": [
        {"kind": "software", "host": cell.host(part), "at": "0 s", "down_for": f"{start_s} s"}
        for cell in cells for part, start_s in cell.starts_s.items()]}
    # Real frames pass the guest's.
    stack = [] if real else [{"rule": _STACK, "until": f"{cells[0].seconds + 1} s"}]
    places = {cell.host(part): place for cell in cells for part, place in cell.parts.items()}
    robots = [host for host, place in places.items() if isinstance(place, Path)]
    fleet: dict[str, object] = {"size": len(robots)}
    if robots:
        fleet["start"] = {"poses": [{"name": robot, "x": "0 m", "y": "0 m"} for robot in robots]}
        own["coordination"] = {"strategy": "follow", "file": str(DRIVE),
                               "names": dict.fromkeys(robots, "out_and_back")}
    return {
        "name": "judge", "seed": seed, "deployment": "field", "fleet": fleet,
        "environment": {"terrain": {"size": ["900 m", "900 m"], "drawing": {
            "cell": "900 m", "lines": ["+--+", "|  |", "+--+"]}}},
        "hosts": {host: {"at": [f"{place[0]} m", f"{place[1]} m"]}
                  for host, place in places.items() if not isinstance(place, Path)},
        "network": {"media": {cell.name: {
            **cell.medium.model, "rules": [
                {"rule": _TAP, "since": f"{cell.since_s} s"}, *cell.medium.rules, *stack],
            "hosts": [cell.host(part) for part in cell.parts]} for cell in cells}},
        "loop": {"programs": [
            {"host": cell.host(act.part), "run": act.run, "at": f"{act.at_s} s",
             "env": dict(act.env), "folder": str(PROGRAMS)}
            for cell in cells for act in cell.acts] if real else []},
        "trace": {"keep": "messages"},
        "stop": {"by": "none", "elapsed": f"{max(cell.seconds for cell in cells)} s"}, **own}
