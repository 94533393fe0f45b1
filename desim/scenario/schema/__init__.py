"""The schema of a scenario, a family of parameters a file."""
