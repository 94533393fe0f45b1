"""Kinds of map sharing, the plug-ins of ``coordination.exchange``, and what several of them use."""
