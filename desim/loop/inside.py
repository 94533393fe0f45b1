"""The process beside the real programs, where they run: in the guest, or on this machine.

    python -P -m desim.loop.inside FOLDER

It carries out the order in the folder, and leaves its answer there.
"""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import traceback
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from desim import api
from desim.engine.kernel import Phase
from desim.errors import InputError
from desim.loop.attached import System, attached
from desim.loop.order import INTERRUPTED, NEWS, PROGRESS, STOP, LoopAnswer, Order
from desim.loop.outside_strategy import OutsideStrategies
from desim.loop.programs import ProgramEnd
from desim.results.folder import RunFolder
from desim.scenario.load import load
from desim.simulation.simulation import Simulation
from desim.units import NS_PER_S

# By clock. A guest is up after a second or less, and waiting takes no real time there.
_BEGIN_EVERY_NS = {"virtual": 10 * NS_PER_S, "wall": 1}
_SPARE_NS = {"virtual": 0, "wall": 60_000}  # a wake-up takes tens of us


def main(folder: Path) -> int:
    """Carry out the order in ``folder``. Returns the exit code."""
    try:
        answer = LoopAnswer(0, _run(Order.read(folder), folder))
    except KeyboardInterrupt as stopped:
        answer = LoopAnswer(INTERRUPTED, str(stopped))
    except InputError as error:
        answer = LoopAnswer(2, error=str(error))
    except Exception as error:
        answer = LoopAnswer(1, error="\n".join([str(error), *getattr(error, "__notes__", ())]),
                        traceback=traceback.format_exc())
    answer.write(folder)
    return answer.code


def _run(order: Order, folder: Path) -> str:
    loaded = load(order.scenario, order.changes, order.seed)
    # Linux wakes a process up to 50 us late, unless it asks for less (prctl(2), timer slack).
    Path("/proc/self/timerslack_ns").write_text("1", "utf-8")
    home = Path("/run/home")
    home.mkdir(exist_ok=True)
    strategies = OutsideStrategies(loaded.scenario.loop.hosts)

    def report(end: ProgramEnd) -> None:
        if end.code:
            with (folder / NEWS).open("a", encoding="utf-8") as news:
                news.write(f"{end}\n")

    system = System(order.clock, _BEGIN_EVERY_NS[order.clock], _SPARE_NS[order.clock],
                    order.capture, home, _name_hosts, report)

    def reached(second: int) -> None:
        (folder / PROGRESS).write_text(str(second), "utf-8")
        if (folder / STOP).exists():
            signal.raise_signal(signal.SIGINT)

    if order.clock == "wall":
        with suppress(PermissionError):  # else as the others
            os.sched_setscheduler(0, os.SCHED_FIFO | os.SCHED_RESET_ON_FORK, os.sched_param(20))

    @contextmanager
    def watch(simulation: Simulation, results: RunFolder) -> Iterator[None]:
        simulation.kernel.ticker(1, Phase.OBSERVE, simulation.names.id(PROGRESS), reached)
        with attached(simulation, results, system, strategies):
            yield
        if order.clock == "virtual":
            results.notes["reclaimed_pages"] = _reclaimed_pages()

    return str(api.run_beside_programs(loaded, order.out, watch, strategies.pilot,
                                       order.command).path)


def _reclaimed_pages() -> int:
    """The pages that Linux has looked at for want of memory, so far. It depends on this machine
    when it does."""
    counts = dict(line.split() for line in Path("/proc/vmstat").read_text("utf-8").splitlines())
    return int(counts["pgscan_kswapd"]) + int(counts["pgscan_direct"])


def _name_hosts(text: str) -> None:
    """Let /etc/hosts have ``text``, in this mount namespace."""
    file = Path("/run/hosts")
    file.write_text(text, "utf-8")
    subprocess.run(["mount", "--bind", file, "/etc/hosts"], check=True)


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1])))
