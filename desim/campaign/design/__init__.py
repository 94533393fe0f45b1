"""The design of a campaign: its parameters, its vectors, and the plan of its runs."""
