"""The paper's cluster for a design: which robot is on which node."""
