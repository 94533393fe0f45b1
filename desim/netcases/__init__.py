"""Networks without robots: plays a network case, and the load of a whole fleet.

The standard cases are in ``netmodels.cases``.
"""
