"""Strategies: where a robot goes next. The plug-ins of ``coordination.strategy``."""
