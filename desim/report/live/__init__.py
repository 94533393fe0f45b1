"""A running simulation, served to a browser of this machine or to Foxglove."""
