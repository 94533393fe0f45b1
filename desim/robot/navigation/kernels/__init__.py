"""Compiled loops of navigation. State comes as in ``desim/robot/kernels``."""
