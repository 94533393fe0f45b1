"""The former place of rules, for older installations."""

from netmodels.rules.outage import Flapping, OnOffProcess

__all__ = ["Flapping", "OnOffProcess"]
