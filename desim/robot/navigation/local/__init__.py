"""The local planner: the velocity to drive next."""
