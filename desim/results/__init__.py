"""The folder that a run leaves, and reading it again."""
