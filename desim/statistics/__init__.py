"""What the numbers of a campaign say, and how surely. Pure functions of arrays: one value a run.

Nothing is imported here, so that whoever asks for one file pays for one.
"""
