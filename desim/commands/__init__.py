"""The commands, one file per group of commands.

Heavy imports stand inside them, so that ``--help`` is fast.
"""
