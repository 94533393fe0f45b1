"""The views: the output of the commands, one file per view."""
