"""Compiled functions of the switch."""
