"""Rules in front of a network model: delay, loss, range, cuts, jamming."""
