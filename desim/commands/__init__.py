"""The commands, a family a file. Heavy imports stand inside them, so that ``--help`` is fast."""
