"""Logs of real robots for SLAM: reading them, playing them, and the error of the path."""
