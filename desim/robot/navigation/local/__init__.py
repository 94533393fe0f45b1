"""The local planner: what the laser sees now, and the velocity to drive next."""
