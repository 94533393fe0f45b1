"""Mapping: the node that maps a robot's scans, the map that it keeps, and how sources are fused."""
