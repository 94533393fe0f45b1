"""ROS 1: what its processes say to each other."""
