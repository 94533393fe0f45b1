"""The parts of tools/bench.py: what it measures, and how it compares two commits."""
