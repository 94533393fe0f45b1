"""ROS 1: the messages between its processes."""
