"""Programs start when they should, with their host and once, and end with it."""

from __future__ import annotations

from graphs import MS, Net, silent

from desim.loop import programs
from desim.loop.programs import ProgramStarter
from desim.scenario.schema.loop import Program
from netmodels.ideal import Ideal


class Started:
    """A program that has ended already."""

    pid = 0

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
    starter = ProgramStarter(host, [(4, Program(host="a", run="x", at=at))], {}, folder)
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
    assert ends == [("a", "x", "a.4.log", 3)]


def test_it_starts_anew_with_its_host_and_both_ends_are_kept(monkeypatch, tmp_path):
    begun, ends = played(monkeypatch, tmp_path, "20 ms", [(30, 40)])
    assert begun == [20, 40]
    assert ends == [("a", "x", "a.4.log", 3)] * 2


def test_a_host_that_is_up_again_before_that_time_starts_it_once(monkeypatch, tmp_path):
    assert played(monkeypatch, tmp_path, "20 ms", [(5, 10)])[0] == [20]


def test_what_was_due_while_the_host_was_down_starts_with_it(monkeypatch, tmp_path):
    assert played(monkeypatch, tmp_path, "20 ms", [(5, 50)])[0] == [50]
