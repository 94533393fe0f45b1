"""Terrains that are generated from a size and a seed."""
