"""The programs that play the real side, each for itself: they know nothing of desim."""
