"""Compiled loops of navigation. State comes as in ``desim/robot/mapping/kernels``."""
