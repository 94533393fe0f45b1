"""The names of the files in a run's folder; docs/results.md describes them.

Nothing for which ``is_written`` does not hold is ever removed from a run's folder.
"""

import re

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
# The output of real programs by host and number, and captures by medium (desim loop).
_OF_PROGRAMS = re.compile(r"[A-Za-z][A-Za-z0-9_]*\.([0-9]+\.log|ros1_bridge\.log|pcap)")


def is_written(name: str) -> bool:
    """Whether desim writes files of this ``name``, a path from the run's folder on."""
    return name in WRITTEN or _OF_PROGRAMS.fullmatch(name) is not None
