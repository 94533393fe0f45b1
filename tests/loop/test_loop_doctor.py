"""The needs of real programs: what of them is there, and how to get the rest."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest
from typer.testing import CliRunner

from desim.cli import app
from desim.errors import InputError
from desim.loop import doctor

TOOLS = ("ip", "mount", "gcc", "make", "flex", "bison", "bc", "tar", "xz")


@pytest.fixture
def machine(monkeypatch):
    """Let a machine have these programs, sources and guest kernel."""
    def has(tools=TOOLS, source="/usr/src/linux-source-6.1.tar.xz", kernel="/c/linux"):
        def found():
            if kernel is None:
                raise InputError("there is no guest kernel yet")
            return Path(kernel)

        monkeypatch.setattr(shutil, "which",
                            lambda name, path: f"/bin/{name}" if name in tools else None)
        monkeypatch.setattr(doctor, "newest_source", lambda: source and Path(source))
        monkeypatch.setattr(doctor, "guest_kernel", found)
    return has


def missing():
    return {finding.what: (finding.remedy, finding.needed) for finding in doctor.findings()
            if finding.remedy is not None}


def test_where_all_is_there_nothing_is_missing(machine):
    machine()
    assert missing() == {}
    assert len(doctor.findings()) == len(TOOLS) + 2
    said = CliRunner().invoke(app, ["loop", "doctor"])
    assert said.exit_code == 0
    assert said.stdout.splitlines()[-1] == "ok       guest kernel: /c/linux"


def test_with_a_kernel_nothing_is_needed_to_build_one(machine):
    machine(tools=("ip", "mount"), source=None)
    assert {needed for _, needed in missing().values()} == {False}
    assert CliRunner().invoke(app, ["loop", "doctor"]).exit_code == 0


def test_without_a_kernel_the_tools_of_its_build_are_needed(machine):
    machine(tools=("ip", "mount", "gcc"), source=None, kernel=None)
    assert missing() == {
        **{f"program {tool}": (f"apt-get install {package}", True) for tool, package in
           {"make": "make", "flex": "flex", "bison": "bison", "bc": "bc", "tar": "tar",
            "xz": "xz-utils"}.items()},
        "sources of Linux": ("apt-get install linux-source, or desim loop build --source", True),
        "guest kernel": ("there is no guest kernel yet", True)}
    said = CliRunner().invoke(app, ["loop", "doctor"])
    assert said.exit_code == 1
    assert said.stdout.splitlines()[-1] == "missing  guest kernel: there is no guest kernel yet"


def test_what_programs_need_is_missed_beside_a_kernel_too(machine):
    machine(tools=TOOLS[1:])
    assert missing() == {"program ip": ("apt-get install iproute2", True)}
    assert CliRunner().invoke(app, ["loop", "doctor"]).exit_code == 1


def test_another_system_has_one_finding(machine, monkeypatch):
    machine()
    monkeypatch.setattr("sys.platform", "darwin")
    assert missing() == {"Linux": (
        "real programs run in a guest of Linux on x86-64 alone", True)}
