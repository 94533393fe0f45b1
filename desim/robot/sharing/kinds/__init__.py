"""The kinds of map sharing: plug-ins of ``coordination.exchange``."""
