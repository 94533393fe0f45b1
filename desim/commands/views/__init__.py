"""What the commands print, a view a file."""
