"""Network models and rules: plug-ins of desim that use its ports alone."""
