"""Compiled loops of navigation."""
