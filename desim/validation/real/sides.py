"""The two sides of a comparison: real programs in the guest, and our models of them."""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

from desim.errors import ModelError
from desim.loop.guest_kernel import guest_kernel
from desim.loop.order import MEMORY_MB, Order
from desim.loop.packets import CHECK_BYTES, MIN_FRAME_BYTES
from desim.loop.rehearsal import rehearse
from desim.loop.supervision import Watcher
from desim.loop.virtual import run_virtually
from desim.results.run import Run
from desim.scenario.load import from_mapping, load
from desim.simulation.simulation import Simulation
from desim.units import NS_PER_S
from desim.validation.real.cell import Act, Cell, Heard, Played, SentFrames, scenario_of
from desim.validation.real.wire_tap import WireTap, more

_NOBODY = Watcher(lambda reached_s, of_s: None, lambda line: None)


def really(cells: Sequence[Cell], seed: int, out: Path | None = None) -> dict[str, Played]:
    """Play ``cells`` by their real programs, all in one guest; the outcome by cell. ``out``: where
    the run stays. Raises ``InputError`` where no guest kernel is, ``ModelError`` for a run that
    failed, and ``KeyboardInterrupt`` with the path of what stays."""
    kernel = guest_kernel()
    with TemporaryDirectory(prefix="desim-judge-") as home:
        file = Path(home) / "judge.yaml"
        file.write_text(json.dumps(scenario_of(cells, seed, real=True)), "utf-8")  # YAML, too
        scenario = load(file).scenario
        rehearse(scenario)
        order = Order(str(file), [], None, str(out or Path(home) / "out"), "")
        try:
            run = run_virtually(order, scenario, kernel, MEMORY_MB, _NOBODY)
        except KeyboardInterrupt:
            if out is None:  # its folder goes
                raise KeyboardInterrupt from None
            raise
        _require_all_ran(run)
        return _outcomes(cells, run)


def _require_all_ran(run: Run) -> None:
    """Raise ``ModelError`` for a program that has ended: all of them run until the end."""
    for program in run.manifest["loop"]["programs"]:
        if program["code"] is not None:
            said = (run.path / program["log"]).read_text(errors="replace").strip()
            raise ModelError(f"{program['host']}: {program['run']} has ended with "
                             f"{program['code']}: {said.rpartition(chr(10))[2]}")


def modelled(cell: Cell, seed: int) -> Played:
    """Play ``cell`` by our model, on the same network with the same random numbers."""
    simulation = Simulation(from_mapping(scenario_of([cell], seed, real=False)).scenario)
    heard = cell.attach(simulation, cell)
    simulation.run()
    tap = next(medium for medium in simulation.graph.media if medium.name == cell.name).rules[0]
    assert isinstance(tap, WireTap)
    sent = tap.sent
    return Played({part: sent.get(cell.host(part), SentFrames()) for part in cell.parts}, heard(),
                  cell.starts_s)


def _outcomes(cells: Sequence[Cell], run: Run) -> dict[str, Played]:
    """The outcome of each cell in a run with real programs, until the cell's own end."""
    sent, logs = _sent(cells, run), list(_logs(cells, run))
    # A program starts when it should, or a little later.
    zero_s = min(float(line[1]) - act.at_s for _, act, lines in logs for line in lines
                 if line[0] == "began")
    found = {cell.name: Played({part: sent[cell.host(part)] for part in cell.parts}, [], {})
             for cell in cells}
    for cell, act, lines in logs:
        outcome = found[cell.name]
        for word, *rest in lines:
            if word == "called":
                outcome.called_s[act.part] = float(rest[0]) - zero_s
            elif word == "heard" and (at_s := float(rest[1]) - zero_s) <= cell.seconds:
                outcome.heard.append(Heard(act.part, int(rest[0]), at_s,
                                           float(rest[2]) - zero_s))
    return found


def _logs(cells: Sequence[Cell], run: Run) -> Iterator[tuple[Cell, Act, list[list[str]]]]:
    """The lines of each program's log, in words."""
    acts = [(cell, act) for cell in cells for act in cell.acts]
    for number, (cell, act) in enumerate(acts):
        log = run.path / f"{cell.host(act.part)}.{number}.log"
        yield cell, act, [words for line in log.read_text(errors="replace").splitlines()
                          if (words := line.split())]


def _sent(cells: Sequence[Cell], run: Run) -> dict[str, SentFrames]:
    """The frames of each host, by the log of real ones; a broadcast has a row a receiver."""
    counted_ns = {cell.host(part): (cell.since_s * NS_PER_S, cell.seconds * NS_PER_S)
                  for cell in cells for part in cell.parts}
    sent = dict.fromkeys(counted_ns, SentFrames())
    names = ("source", "number", "born_ns", "size_bytes")
    table = run.table("messages", names)
    for source, _, born_ns, size_bytes in dict.fromkeys(zip(*(
            table[name].tolist() for name in names), strict=True)):
        since_ns, end_ns = counted_ns[source]
        if since_ns <= born_ns <= end_ns:
            sent[source] = more(sent[source], 1, max(size_bytes, MIN_FRAME_BYTES) + CHECK_BYTES)
    return sent
