"""Strategies: where a robot explores next."""
