"""Compiled loops of a robot's maps."""
