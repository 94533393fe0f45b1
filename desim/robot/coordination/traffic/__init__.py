"""Traffic on a grid of cells: who may be where next."""
