"""Localization: the nodes that publish a robot's pose, and the context of a plug-in."""
