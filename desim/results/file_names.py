"""The names of the files in a run's folder; docs/results.md describes them.

Nothing that ``written_by`` does not name is ever removed from a run's folder.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:  # names alone shall import nothing heavy
    from desim.scenario.schema.scenario import Scenario

MANIFEST = "manifest.json"  # written last, it seals the others
SCENARIO = "scenario.resolved.yaml"
SUMMARY = "summary.json"
NAMES = "names.json"  # of the ids in trace rows
SAMPLES = "samples.parquet"
ROBOTS = "robots.parquet"
LINKS = "links.parquet"
MESSAGES = "messages.parquet"
LEDGER = "ledger.parquet"
LEDGER_TOPICS = "ledger_topics.json"  # the ledger's sums, which campaigns read in its place
TRACE = "trace.parquet"
# Two of the recording; all of its tables: RECORDED of recording_tables.py.
POSES = "poses.parquet"
EVENTS = "events.parquet"
MAPS = "map"  # the one folder in a run's folder
LOCK = ".lock"  # while the run is written

WRITTEN = (
    MANIFEST, SUMMARY, SCENARIO, NAMES, LOCK, LEDGER_TOPICS, SAMPLES, ROBOTS, LINKS, MESSAGES,
    LEDGER, TRACE, POSES, EVENTS, "latency.parquet", "moving_obstacles.parquet", "growth.parquet",
    "plans.parquet", "walls.parquet",
    *(f"{MAPS}/{name}.{ending}" for name in ("truth", "merged") for ending in ("pgm", "yaml")))


def written_by(scenario: Scenario) -> frozenset[str]:
    """The names of all files of a run of ``scenario``: also the output of real programs by host and
    number, and their captures by medium."""
    programs, media = scenario.loop.programs, scenario.network.media
    return frozenset([
        *WRITTEN, *(f"{program.host}.{number}.log" for number, program in enumerate(programs)),
        *(f"{program.host}.{bridge}.log" for program in programs
          for bridge in ("ros1_bridge", "ros2_bridge")),
        *(f"{medium}.pcap" for medium in media if programs)])
