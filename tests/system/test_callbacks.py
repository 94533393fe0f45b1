"""Is the table of nodes, their triggers and their work in docs/computers.md complete?"""

import re

from recording_costs import Recording
from runs import HELLO, MAZE_8, SCENARIOS, built

RECORDED = "computers=recording_costs:Recording"
PATROL = SCENARIOS / "patrol.yaml"
REAR = "lasers: {front: {}, rear: {yaw: 180 deg}}"
RUNS = [
    (HELLO,), (PATROL,),
    *((HELLO, f"robot.localization={kind}") for kind in ("odometry", "scan_matching", "gmapping")),
    (HELLO, "robot.localization={model: gmapping, host: workstation}"),
    *((HELLO, f"coordination.exchange={kind}")
      for kind in ("frontiers", "relayed", "scans", "submaps")),
    (HELLO, "robot.localization=gmapping", "coordination.exchange=mrs_testbed"),
    (MAZE_8, "fleet.size=2", "fleet.start={apart: 5 m}",
     "coordination.exchange.model=registered_maps"),
    *((HELLO, f"coordination.strategy={name}") for name in (
        "connectivity", "explore_multirobot", "greedy_assignment", "hungarian", "market", "minpos",
        "next_best_view", "random_frontier", "rendezvous", "role_based", "voronoi")),
    (HELLO, "coordination.strategy=centralized", "hosts={base: {strategy: centralized}}"),
    *((PATROL, f"coordination.strategy={name}")
      for name in ("conscientious_reactive", "cyclic_patrol")),
    (HELLO, "deployment=field", f"robot={{tf: own, sonar: {{}}, bumper: true, {REAR}}}",
     "hosts={base: {monitor: true}}"),
    (HELLO, "testbed.processes={scan: 3, tf: 4}", "robot.tf=all",
     "robot.publishes=[{topic: TOPIC, size: 1 kB, rate: 10 Hz, to: workstation}]")]


def documented(page):
    """(node, trigger) and (node, quantity) of the table."""
    rows = page.read_text().partition("| node | triggers | declares |\n")[2].partition("\n\n")[0]
    triggers, quantities = set(), set()
    for row in rows.splitlines()[1:]:
        nodes, called_by, declared = (re.findall(r"`([^`]+)`", cell)
                                      for cell in row.split("|")[1:4])
        for node in nodes:
            if node not in ("robot.publishes", "testbed.processes"):
                triggers |= {(node, trigger) for trigger in called_by}
                quantities |= {(node, quantity) for quantity in declared}
    return triggers, quantities


def test_the_page_has_all_nodes_with_their_triggers_and_their_work(repository):
    Recording.seen.clear()
    for file, *overrides in RUNS:
        built(file, *overrides, RECORDED, "stop.elapsed=9 s").run()
    triggers, quantities = documented(repository / "docs" / "computers.md")
    assert Recording.seen.keys() == triggers
    assert quantities == {(node, quantity) for (node, _), own in Recording.seen.items()
                          for quantity in own if quantity != "bytes"}
