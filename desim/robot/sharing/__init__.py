"""Kinds of map sharing by name: the plug-ins of ``coordination.exchange``."""
