"""Recordings for ROS tools: MCAP files of ROS 2, bags of ROS 1, layouts for Foxglove and rviz."""
