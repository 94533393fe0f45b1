"""Messages between nodes: the ROS graph, transports, and who learns of whom."""
