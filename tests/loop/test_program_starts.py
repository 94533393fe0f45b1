"""Programs start when they should, with their host and once, and end with it."""

from __future__ import annotations

import os

import pytest
from graphs import MS, Net, silent

from desim.errors import InputError
from desim.loop import programs
from desim.loop.program_input import ProgramInput
from desim.loop.programs import ProgramStarter, refuse_missing
from desim.scenario.schema.loop import Program
from netmodels.ideal import Ideal


class Started:
    """A program that ends with code 3 when it is waited for."""

    pid = os.getpid()  # which does not end

    def __init__(self, command, **_):
        self.command = command

    def poll(self):
        return 3

    def wait(self, _=None):
        return 3


def played(monkeypatch, folder, at, outages):
    """The instants (ms) at which the program of host a starts, and its ends; ``outages`` of the
    host: (from, until)."""
    net = Net(dict.fromkeys("ab", silent), Ideal(Ideal.Params(delay="1 ms")))
    host, kernel, begun = net.graph.host("a"), net.kernel, []

    def popen(command, **_):
        begun.append(kernel.now_ns // MS)
        return Started(command)

    monkeypatch.setattr(programs.subprocess, "Popen", popen)
    starter = ProgramStarter(host, [(4, Program(host="a", run="x", at=at))], {}, folder,
                             ProgramInput(kernel, None), None)
    host.stop()
    host.software = lambda host: [starter]
    host.start()
    for down_ms, up_ms in outages:
        kernel.run(down_ms * MS)
        host.stop()
        kernel.run(up_ms * MS)
        host.start()
    kernel.run(100 * MS)
    return begun, starter.end()


def test_a_program_starts_at_its_time(monkeypatch, tmp_path):
    begun, ends = played(monkeypatch, tmp_path, "20 ms", [])
    assert begun == [20]
    assert ends == [("a", "x", "a.4.log", 3, None)]


def test_it_starts_anew_with_its_host_and_both_ends_are_kept(monkeypatch, tmp_path):
    begun, ends = played(monkeypatch, tmp_path, "20 ms", [(30, 40)])
    assert begun == [20, 40]
    assert ends == [("a", "x", "a.4.log", 3, None)] * 2


def test_a_host_that_is_up_again_before_that_time_starts_it_once(monkeypatch, tmp_path):
    assert played(monkeypatch, tmp_path, "20 ms", [(5, 10)])[0] == [20]


def test_what_was_due_while_the_host_was_down_starts_with_it(monkeypatch, tmp_path):
    assert played(monkeypatch, tmp_path, "20 ms", [(5, 50)])[0] == [50]


def wrong(run, folder, **keys):
    """The complaint about a program that is to be started so."""
    try:
        refuse_missing([Program(host="a", run="true"),
                        Program(host="a", run=run, folder=str(folder), **keys)])
    except InputError as error:
        return str(error)
    return None


def test_a_program_that_is_not_there_is_said(tmp_path):
    said = ("loop.programs.1.run: there is no program {}; allowed: one in PATH, or a file in "
            f"{tmp_path}")
    assert wrong("rosmastr --core", tmp_path) == said.format("rosmastr")
    assert wrong("./mine", tmp_path) == said.format("./mine")
    (tmp_path / "mine").write_text("#!/bin/sh\n")
    (tmp_path / "mine").chmod(0o755)
    assert wrong("./mine", tmp_path) is None
    assert wrong("mine", tmp_path) == said.format("mine")
    assert wrong("mine", tmp_path, env={"PATH": str(tmp_path)}) is None


@pytest.mark.parametrize("run", [
    "cd / && ls", "exec ls", "$DESIM_PYTHON x.py", "if true; then ls; fi", "A=b ls", '"my program"',
    "for x in 1; do ls; done", "ls; exit 2"])
def test_what_a_shell_understands_otherwise_is_left_to_it(run, tmp_path):
    assert wrong(run, tmp_path) is None
