"""The commands, a family a file. Heavy imports stand inside them: ``--help`` answers at once."""
