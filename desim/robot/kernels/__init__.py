"""Compiled loops of a robot's maps.

State comes to a loop in one way. Arrays that belong together are a NamedTuple of arrays, made once.
Settings and results that are numbers are one record of a dtype. Values of a single call are plain
arguments. From Python, a NamedTuple costs 0.1 us an array more than plain arrays, and 1 us more for
each record in it: loops that run for each robot at its control rate take plain arrays and say so.
Modules import the loops of their own name ``as kernels``.
"""
