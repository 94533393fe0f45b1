"""The pytest fixture ``desim_run``. pytest imports this module when it starts, in projects that
have nothing to do with desim too: so it lies outside of the package, and imports that when asked.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import pytest

if TYPE_CHECKING:
    from desim import Run


class ScenarioRunner:
    """Runs scenarios for a test; each run has a new folder of its own."""

    def __init__(self, folder: Path, new_folders: pytest.TempPathFactory) -> None:
        self._folder, self._new_folders = folder, new_folders

    def __call__(self, scenario: str | Path, *overrides: str, until: str | None = None,
                 seed: int | None = None) -> Run:
        """Run a ``scenario``, a file beside the test's own, with ``A.B.C=VALUE`` laid over it.
        ``until`` is short for ``stop.elapsed=``."""
        from desim import api

        changes = [*overrides, *([] if until is None else [f"stop.elapsed={until}"])]
        return api.run(self._folder / scenario, out=self._new_folders.mktemp("desim"),
                       overrides=changes, seed=seed)

    def same_digest(self, run: Run, wanted: Run | str) -> None:
        """Fail unless everything that happened in ``run`` is what happened in another one, or what
        has the digest ``wanted``. Of two runs the first row that differs is shown."""
        __tracebackhide__ = True
        digest = run.manifest["digest"]
        if isinstance(wanted, str):
            if digest != wanted:
                pytest.fail(f"{run.scenario.name} has the digest {digest}, wanted: {wanted}; made "
                            f"with {run.manifest['versions']}")
        elif digest != wanted.manifest["digest"]:
            from desim.commands.views.differences import difference

            pytest.fail(f"the runs differ: {difference(wanted.path, run.path, trust=True)}")


@pytest.fixture
def desim_run(request: pytest.FixtureRequest,
              tmp_path_factory: pytest.TempPathFactory) -> ScenarioRunner:
    """Run desim's scenarios: ``desim_run("scenario.yaml", until="20 s").metrics``."""
    return ScenarioRunner(request.path.parent, tmp_path_factory)
