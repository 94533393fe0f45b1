"""Animations of a run for slides: GIF and APNG."""
