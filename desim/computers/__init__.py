"""Computers that get busy: processors, their scheduling, and what callbacks and messages cost."""
