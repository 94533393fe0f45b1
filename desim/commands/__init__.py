"""The commands, a family a file. Heavy imports stand inside them: ``desim --help`` answers at once."""
