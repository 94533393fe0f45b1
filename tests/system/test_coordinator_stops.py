"""The coordinator of an exploration stops in mid run: robots go on alone, and obey it again."""

import pytest
from runs import MAZE_8, built

from desim.robot.coordination.strategies.centralized import Centralized

FIELD = ("deployment=field", "coordination.strategy=centralized",
         "hosts.base={strategy: centralized}")


@pytest.mark.parametrize("trouble", [
    "faults=[{at: 30 s, host: base, down_for: 40 s}]",
    "network.media.lan.rules=[{rule: outage, hosts: ['*'], from: 30 s, until: 70 s}]"])
def test_robots_go_on_alone_and_obey_again(trouble, monkeypatch):
    strategies, start = {}, Centralized.on_start

    def on_start(self, host):
        strategies[host.name] = self, host
        start(self, host)

    monkeypatch.setattr(Centralized, "on_start", on_start)
    simulation = built(MAZE_8, *FIELD, trouble)
    simulation.graph.start()
    alone, ways_m = [], []
    for at_s in (30, 46, 69, 90):
        simulation.kernel.run(at_s * 10**9)
        alone.append(sum(one._is_alone(host) for one, host in strategies.values()
                         if host.has_body))
        ways_m.append(simulation.world.travelled_m().sum())
    assert alone == [0, 8, 8, 0]  # TCP tries again 51 s after the first loss at the latest
    assert ways_m[2] - ways_m[1] > 8 * 5  # in 23 s
