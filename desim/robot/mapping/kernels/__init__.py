"""Compiled loops of a robot's maps.

State comes to a loop in one way. Arrays that belong together are a NamedTuple of arrays, made once.
Settings and results that are numbers are one record of a dtype. Values of a single call are plain
arguments. Modules import the loops of their own name ``as kernels``.
"""
