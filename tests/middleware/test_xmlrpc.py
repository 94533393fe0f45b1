"""XML-RPC: calls, kept alive connections, and what becomes of calls that nobody answers."""

import pytest
from graphs import MS, S
from tcp_hosts import Pair, link

from desim.middleware.ros1.xmlrpc import XmlRpc


class Calls(Pair):
    """``a`` calls ``b``, which answers everything, after ``think_ns``."""

    def __init__(self, *args, think_ns=0, **options):
        super().__init__(*args, **options)
        self.rpc = XmlRpc(self.net.graph.context, self.tcp)
        self.rpc.serve(1, "slave", self._answer)
        self._think_ns = think_ns

    def _answer(self, call):
        self.note("asked", call.request)
        if self._think_ns:
            self.at(self.net.kernel.now_ns + self._think_ns, call.reply, 383, call.request.upper())
        else:
            call.reply(383, call.request.upper())

    def ask(self, request, service="slave", **options):
        self.rpc.call(0, 1, service, "xmlrpc", 434, request,
                      lambda ok, response: self.note("done", ok, response), **options)

    def stop(self, host):
        self.rpc.forget(host)
        super().stop(host)


def test_a_call_takes_two_round_trips_and_the_next_one_one():
    calls = Calls(link(rate="1 Gb/s", latency="1 ms"))
    calls.ask("x")
    calls.at(S, calls.ask, "y").run(2 * S)
    assert calls.log == [
        (3_005_840, "asked", "x"), (4_009_464, "done", True, "X"),
        (1_001_004_032, "asked", "y"), (1_002_007_656, "done", True, "Y")]


def test_an_idle_connection_is_closed_after_30_s():
    calls = Calls(link(rate="1 Gb/s", latency="1 ms"))
    calls.ask("x")
    calls.at(29 * S, calls.ask, "y").at(60 * S, calls.ask, "z").run(200 * S)
    assert [row[0] // MS for row in calls.rows() if row[-1] == 78] == [0, 1, 60_000, 60_001]
    assert calls.at_rest()


def test_connections_are_closed_each_in_its_time():
    calls = Calls(link(rate="1 Gb/s", latency="1 ms"))
    calls.ask("x")
    calls.ask("y")
    calls.at(10 * S, calls.ask, "z").run(35 * S)  # the one that rests last is used again
    assert len([row for row in calls.log if row[1] == "done"]) == 3
    assert len(calls.rpc._idle[0, 1, "slave"]) == 1
    calls.at(45 * S, calls.stop, 0).run(100 * S)
    assert calls.at_rest()


def test_a_fresh_connection_is_closed_after_the_answer():
    calls = Calls(link(rate="1 Gb/s", latency="1 ms"))
    calls.ask("x", fresh=True)
    calls.at(S, calls.ask, "y").run(2 * S)
    assert [row[0] for row in calls.log if row[1] == "done"] == [4_009_464, 1_004_009_464]


def test_calls_at_once_have_a_connection_each():
    calls = Calls(link(rate="1 Gb/s", latency="1 ms"))
    calls.ask("x")
    calls.ask("y")
    calls.at(S, calls.ask, "z").run(2 * S)
    assert [row[1:] for row in calls.log] == [
        ("asked", "x"), ("asked", "y"), ("done", True, "X"), ("done", True, "Y"),
        ("asked", "z"), ("done", True, "Z")]
    assert len([row for row in calls.rows() if row[-1] == 78]) == 4


def test_nobody_is_notified_on_a_host_that_stopped():
    calls = Calls(link(rate="1 Gb/s", latency="1 ms"))
    calls.ask("x", timeout_ns=S)
    calls.at(3 * MS + MS // 2, calls.stop, 0).at(4 * MS, calls.start, 0).run(2000 * S)
    assert calls.log == [(3_005_840, "asked", "x")]
    assert calls.at_rest()


def test_a_server_that_stops_while_it_thinks():
    """Its TCP has acknowledged the request, and nothing keeps the connection alive: the caller
    waits for ever. Another call finds that nobody serves any more."""
    calls = Calls(link(rate="1 Gb/s", latency="1 ms"), think_ns=100 * MS)
    calls.ask("x")
    calls.at(50 * MS, calls.stop, 1).at(60 * MS, calls.start, 1)
    calls.at(S, calls.ask, "y").run(300 * S)
    assert [row[1:] for row in calls.log] == [("asked", "x"), ("done", False, None)]


def test_nobody_serves():
    calls = Calls()
    calls.ask("x", "other")
    assert calls.run(S).log == [(0, "done", False, None)]


@pytest.mark.parametrize("held", [False, True])
def test_a_new_connection_that_is_refused_is_not_opened_again(held):
    """Only one that has rested is: its server may have closed it meanwhile."""
    calls = Calls(link(rate="1 Gb/s", latency="1 ms"))
    calls.ask("x", "other", held=held)
    (done_ns, *outcome), = calls.run(S).log
    assert (done_ns // MS, *outcome) == (2, "done", False, None)


def test_a_held_request_goes_when_it_is_released():
    calls = Calls(link(rate="1 Gb/s", latency="1 ms"))
    call = calls.rpc.call(0, 1, "slave", "xmlrpc", 434, "x",
                          lambda ok, response: calls.note("done", ok, response), held=True)
    calls.at(S, call.release).run(2 * S)
    assert [(row[0] // MS, *row[1:]) for row in calls.log] == [
        (1001, "asked", "x"), (1002, "done", True, "X")]


def test_a_timeout():
    calls = Calls(rules=[])
    calls.stop(1)
    calls.ask("x", timeout_ns=3 * S)
    calls.run(1000 * S)
    assert calls.log == [(3 * S, "done", False, None)]
    assert calls.at_rest()


def test_a_server_that_restarted_is_called_anew():
    calls = Calls()
    calls.ask("x")
    calls.at(S, calls.stop, 1).at(2 * S, calls.start, 1)
    calls.at(2 * S, lambda: calls.rpc.serve(1, "slave", calls._answer))
    calls.at(3 * S, calls.ask, "y").run(10 * S)
    assert [row[1:] for row in calls.log] == [("asked", "x"), ("done", True, "X"),
                                             ("asked", "y"), ("done", True, "Y")]


def test_within_a_host():
    calls = Calls()
    calls.rpc.call(1, 1, "slave", "xmlrpc", 434, "x",
                   lambda ok, response: calls.note("done", ok, response))
    assert calls.run(S).log == [(0, "asked", "x"), (0, "done", True, "X")]
    assert not calls.rows()


def test_a_server_that_thinks():
    calls = Calls(think_ns=100 * MS)
    calls.at(250 * MS, calls.ask, "x").run(S)
    assert calls.log == [(250 * MS, "asked", "x"), (350 * MS, "done", True, "X")]
