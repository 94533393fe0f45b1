"""The local planners: plug-ins of ``robot.navigation.local``."""
