"""Campaigns, many runs to one question: the design, the running, the folder."""
