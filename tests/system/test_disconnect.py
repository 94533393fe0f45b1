"""The fleet that splits in two, for five seconds, under the middleware that knows everything."""

from __future__ import annotations

from runs import SCENARIOS, audited, built

from desim.monitor.summary import samples_table, summarize

DIRECT = ("middleware=null", "middleware.model=direct")
PARTITION = ("network.media.air.rules.0.from=5 s", "network.media.air.rules.0.until=10 s")


def test_the_two_halves_meet_again():
    simulation = built(SCENARIOS / "multimaster_disconnect.yaml", *DIRECT, *PARTITION,
                       "stop.elapsed=25 s")
    outcome = simulation.run()
    summary = summarize(simulation.monitor, outcome.simulated_ns)
    assert summary["partitions"]["episodes_s"] == [[5.0, 10.0]]
    resync = summary["resync_delay_s"]
    # Eight and eight robots: 2 * 8 * 8 ordered pairs. A stream's last try before 10 s may be as old
    # as the split: the next one comes at most as late, and a map is told at most 5 s after that.
    assert resync["pairs"] == resync["resynced"] == 128
    assert 0.0 < resync["mean"] <= resync["max"] <= 10.0
    assert summary["detection_delay_s"]["pairs"] is None
    assert summary["duplicated_exploration"] > 0.5
    table = samples_table(simulation.monitor)
    ages_s = dict(zip(table["time_s"], table["stale_age_s"], strict=True))
    assert ages_s[10.0] > ages_s[5.0]
    assert "ghosts" not in table
    audited(simulation)
