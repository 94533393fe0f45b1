"""The cluster that the paper's testbed would need for a design, and its robots node by node."""
