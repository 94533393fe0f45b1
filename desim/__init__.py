"""desim: deterministic discrete-event co-simulation of robot fleets and their networks."""

__version__ = "0.1.0"
