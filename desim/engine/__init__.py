"""Time, chance and memory: the clock and its agenda, random streams by name, the trace."""
