"""Simultaneous localization and mapping: a robot's pose and map from its odometry and laser."""
