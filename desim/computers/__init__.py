"""Computers that get busy: processors, their scheduling, and what callbacks and messages cost.

The threads of nodes, which run callbacks on these processors, are in ``desim.middleware``:
``executor.py``, and ``busy_*.py`` for the hosts, publishers, subscriptions and timers there.
"""
