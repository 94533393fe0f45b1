"""The lateness of commands and scans, for the metrics of designs."""

from __future__ import annotations


def command_p95_s(run):
    """95 % of the commands that arrive do so within this time."""
    return _p95_s(run, "/*/cmd_vel")


def scan_p95_s(run):
    """95 % of the laser scans that arrive do so within this time."""
    return _p95_s(run, "/*/scan")


def _p95_s(run, topic):
    return run.metrics["latency_by_topic"].get(topic, {}).get("p95_s")
