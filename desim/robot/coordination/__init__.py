"""Coordination: the node that asks a strategy for goals, and what the strategy knows and does."""
