"""Orders of loads: a desk that gives them to robots, and robots that carry them out."""
