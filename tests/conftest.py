"""Shared by all tests: reproducible property tests, and where the reference data lie."""

import gc
import os
import signal
from functools import cache
from pathlib import Path

import pytest
from hypothesis import settings
from typer import testing

from desim.engine.garbage import freeze_present_objects

settings.register_profile("desim", derandomize=True, deadline=None, max_examples=50)
settings.load_profile("desim")

# The background job of a shell ignores Ctrl-C, and so would what tests start and interrupt.
signal.signal(signal.SIGINT, signal.default_int_handler)


# No test cuts the power: to wait for the disk takes as long as many runs.
os.fsync = lambda descriptor: None

# All calls of commands share one tree of them: to build it takes longer than many commands do.
testing._get_command = cache(testing._get_command)


@pytest.fixture(scope="session")
def repository() -> Path:
    """The root of the checkout."""
    return Path(__file__).resolve().parent.parent


@pytest.fixture(scope="session")
def reference(repository) -> Path:
    """The folder of reference data beside the checkout; tests that need it are skipped without."""
    folder = repository.parent / "shared" / "reference"
    if not folder.is_dir():
        pytest.skip("the reference data folder is not beside the repository")
    return folder


def pytest_collection_finish():
    """A search for garbage passes over thousands of collected tests no more: in the tests of
    campaigns, where each run ends with one, that is a third of the time."""
    gc.collect()
    freeze_present_objects()
