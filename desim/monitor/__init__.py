"""The observer of a run: coverage, partitions, traffic. It alone sees the truth."""
