"""Pages and pictures of runs and campaigns."""
