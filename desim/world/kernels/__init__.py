"""Compiled loops of the world."""
