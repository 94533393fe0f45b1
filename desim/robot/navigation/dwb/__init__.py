"""The parts of the local planner dwb."""
