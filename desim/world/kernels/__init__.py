"""Compiled loops of the world.

The loops of a whole fleet (``bodies.advance``, ``lidar.scan``) take its arrays one by one.
"""
