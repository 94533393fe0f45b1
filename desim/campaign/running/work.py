"""The work of a worker: one run of a campaign, and its row.

A run that fails is a result: its row says why.
"""

from __future__ import annotations

import gc
from typing import NamedTuple

from desim import api
from desim.blame import blame
from desim.errors import InputError
from desim.results.row import Row, failure, row_of
from desim.scenario.load import Loaded


class RunTask(NamedTuple):
    """A run to be made. ``functions`` are the paths of metrics that read the run's folder."""

    run_id: str
    loaded: Loaded
    out: str
    functions: tuple[str, ...]

    def made(self) -> Row:
        return work(self)


class Unwritable(InputError):
    """The results cannot be written, nor could those of any other run."""


class Changed(InputError):
    """The source or a file has changed since the campaign was planned."""


def work(task: RunTask) -> Row:
    """Make the run. Raises ``Unwritable`` where results cannot be written, and ``Changed``."""
    try:
        run = api.run(task.loaded, out=task.out, command="desim sweep")
    except InputError as error:
        if isinstance(error.__cause__, OSError):
            raise Unwritable(*error.args) from error
        return failure(task.run_id, "; ".join(map(str, error.args)))
    except (Exception, KeyboardInterrupt) as error:  # whatever a model or a plug-in does
        return failure(task.run_id, blame(error).line)
    finally:
        gc.collect()  # a run's arrays hang in circles
    if run.manifest["run_id"] != task.run_id:
        raise Changed("the source of desim, of a plug-in or a file of the scenario has changed "
                      "since the campaign began, so that its runs would be others; the same "
                      "command begins anew with what there is now")
    return row_of(run, task.functions)
