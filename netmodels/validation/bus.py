"""The former place of groups of ``shared_channels.py``, for older installations."""

from netmodels.validation.shared_channels import CarrierSenseOfNs3, CollisionsOfEthernet

__all__ = ["CarrierSenseOfNs3", "CollisionsOfEthernet"]
