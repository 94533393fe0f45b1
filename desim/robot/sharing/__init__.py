"""Map sharing: its node, the context of a plug-in, and what several kinds use."""
