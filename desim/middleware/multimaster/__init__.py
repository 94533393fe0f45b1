"""ROS 1 with a master on each host: they find each other and copy what the others know."""
