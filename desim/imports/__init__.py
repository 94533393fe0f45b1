"""Recordings of real robots (MCAP files and bags of ROS), read as runs."""
