"""Real programs on the networks of a scenario: guest kernel, TAPs, programs, and their clock."""
