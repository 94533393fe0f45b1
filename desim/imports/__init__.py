"""Recordings of real robots: those of ROS as runs, those of CARMEN for SLAM."""
