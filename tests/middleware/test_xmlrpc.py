"""XML-RPC: calls, kept alive connections, and what becomes of calls that nobody answers."""

from graphs import MS, S
from tcphosts import Pair, link

from desim.middleware.ros.xmlrpc import XmlRpc


class Calls(Pair):
    """``a`` calls ``b``, which answers everything."""

    def __init__(self, *args, poll_ns=0, **options):
        super().__init__(*args, **options)
        self.rpc = XmlRpc(self.net.graph.context, self.tcp)
        self.rpc.serve(1, "slave", self._answer, poll_ns)

    def _answer(self, call):
        self.note("asked", call.request)
        call.reply(383, call.request.upper())

    def ask(self, request, service="slave", **options):
        self.rpc.call(0, 1, service, "xmlrpc", 434, request,
                      lambda ok, response: self.note("done", ok, response), **options)

    def stop(self, host):
        self.rpc.switched(host, False)
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
    assert not any(calls.tcp._ends.values())


def test_nobody_serves():
    calls = Calls()
    calls.ask("x", "other")
    assert calls.run(S).log == [(0, "done", False, None)]


def test_a_timeout():
    calls = Calls(rules=[])
    calls.stop(1)
    calls.ask("x", timeout_ns=3 * S)
    calls.run(1000 * S)
    assert calls.log == [(3 * S, "done", False, None)]
    assert not any(calls.tcp._ends.values())


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


def test_a_server_that_polls():
    calls = Calls(poll_ns=100 * MS)
    calls.at(250 * MS, calls.ask, "x").run(S)
    assert calls.log == [(300 * MS, "asked", "x"), (300 * MS, "done", True, "X")]
