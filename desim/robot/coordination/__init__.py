"""Coordination: the node that asks a strategy for goals, and what the strategy knows and does.

Frontiers and path lengths come from the search in ``desim/robot/navigation/global_planner.py``,
expected information gain from ``map_queries.py`` beside it.
"""
