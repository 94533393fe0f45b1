"""Compiled kernels: how they are declared, compiled with numba, kept, and loaded without it."""
