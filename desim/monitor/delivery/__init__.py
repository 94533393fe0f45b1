"""The parts of the task delivery: orders that arrive, stations, and batteries."""
