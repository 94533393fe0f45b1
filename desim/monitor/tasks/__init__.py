"""The tasks that come with desim."""
