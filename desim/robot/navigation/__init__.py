"""From a goal to a velocity: costmaps, planners, and recovery (ROS's move_base)."""
