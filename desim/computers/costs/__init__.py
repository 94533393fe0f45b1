"""Cost models: plug-ins of the key ``computers``."""
