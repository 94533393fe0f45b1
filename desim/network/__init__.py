"""Frames and the media that carry them: rules in front, a network model behind, an account."""
