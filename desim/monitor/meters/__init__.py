"""The meters of a run, each in a file of its own: ``meter.py`` says what a meter has."""
