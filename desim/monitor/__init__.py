"""What watches a run: what is explored, who is cut off, what is sent. It alone sees the truth."""
