"""The folder of a campaign: its runs, their index, their table, and a copy of the design."""
