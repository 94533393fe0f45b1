"""Runs to look at, each made once."""

import pytest
from devtools import chromium
from matplotlib.figure import Figure

import desim
from desim.api import recording_of
from desim.report.replay.page import write


@pytest.fixture(scope="session")
def hello(tmp_path_factory, repository):
    """The run of ``hello.yaml``: three robots, 39 s."""
    return desim.run(desim.load(repository / "scenarios" / "hello.yaml"),
                     out=tmp_path_factory.mktemp("hello"))


@pytest.fixture
def svg_alone(monkeypatch):
    """Figures of reports are drawn for the page, and not for their other files, which are empty."""
    savefig = Figure.savefig

    def drawn(figure, path, **options):
        return savefig(figure, path, **options) if path.suffix == ".svg" else path.touch()

    monkeypatch.setattr(Figure, "savefig", drawn)


@pytest.fixture(scope="session")
def browser_here():
    """Skips the test where there is no Chromium."""
    if chromium() is None:
        pytest.skip("there is no Chromium")


@pytest.fixture(scope="session")
def replay(tmp_path_factory, hello):
    """Its replay."""
    page = tmp_path_factory.mktemp("page") / "replay.html"
    write([recording_of(hello)], page)
    return page
