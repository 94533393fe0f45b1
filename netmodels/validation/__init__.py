"""Published numbers, and what the network models make of the same settings: ``desim validate``.

Tables named ns-3 were measured with ns-3.44 (settings in docs/validation.md); a number is the mean
of the runs.
"""
