"""The former place of groups of ``shared_channels.py``, for older installations."""

from netmodels.validation.shared_channels import RandomAccess

__all__ = ["RandomAccess"]
