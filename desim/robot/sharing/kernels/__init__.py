"""Compiled loops of map sharing. State comes as in ``desim/robot/mapping/kernels``."""
