"""What a campaign keeps: its runs, their index, the table, a copy of the design."""
