"""Runs in the formats of other tools, and recordings of other tools as runs."""
