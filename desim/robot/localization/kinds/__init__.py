"""The kinds of localization: plug-ins of ``robot.localization``."""
