"""A rehearsal: a run of a hundredth of a second that shows which metrics runs have.

It runs plug-ins, so that a campaign has a worker make it.
"""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple, Protocol

from desim import api, plugins
from desim.blame import blame
from desim.errors import InputError, described
from desim.results.row import Row, failure, flat
from desim.results.status import RunStatus
from desim.scenario.load import Loaded

# Long enough for everything to be measured once, and too short to be felt.
_REHEARSAL_NS = 10_000_000


class Errand(Protocol):
    """A piece of work for a worker."""

    @property
    def run_id(self) -> str:
        """The run that it is about."""

    def made(self) -> Row:
        """Do it. Raises ``InputError`` where more of the kind is pointless."""


Made = Callable[[Errand], Row]


def here(task: Errand) -> Row:
    """Do a task in this process."""
    return task.made()


class Rehearsal(NamedTuple):
    """The task of a rehearsal. ``functions`` are the paths of metrics that read a run's folder.
    Its row has the errors of those that fail as ``raised``."""

    run_id: str
    loaded: Loaded
    functions: tuple[str, ...]

    def made(self) -> Row:
        scenario = self.loaded.scenario
        stop = scenario.stop.model_copy(update={"elapsed_ns": _REHEARSAL_NS})
        short = replace(self.loaded, scenario=scenario.model_copy(update={"stop": stop}))
        with tempfile.TemporaryDirectory() as folder:
            try:
                run = api.run(short, out=Path(folder))
            except InputError:
                raise
            except (Exception, KeyboardInterrupt) as error:  # of a model or a plug-in
                return failure(self.run_id, blame(error).line)
            raised = {}
            for path in self.functions:
                try:
                    value = plugins.imported("function", path)(run)
                    if value is not None:
                        float(value)
                except InputError as error:
                    raised[path] = str(error)
                except (Exception, SystemExit) as error:  # a user's function may fail in any way
                    raised[path] = (f"{plugins.bare(path)} raised {described(error)} (tried on a "
                                    "run of 0.01 s)")
            return {"run_id": self.run_id, "status": RunStatus.FINISHED.value,
                    "metrics": flat(run.metrics), "raised": raised}
