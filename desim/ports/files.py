"""Files that a scenario names: plug-ins read them with the limits that desim has for strangers'."""

from desim.unpacking import lines

__all__ = ["lines"]
