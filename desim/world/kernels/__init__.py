"""Compiled loops of the world.

State comes as in ``desim/robot/kernels``; the loops of a whole fleet (``bodies.advance``,
``lidar.scan``) take plain arrays, for the reason that ``advance`` states.
"""
