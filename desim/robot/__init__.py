"""What runs on a robot's computer. It knows only what it sensed and what it received."""
