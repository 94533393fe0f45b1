"""The views: the output of the commands, a view a file."""
