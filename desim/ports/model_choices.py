"""The contract of a network plug-in that chooses among models."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Protocol, cast

from desim.ports import parameters
from desim.ports.networks import NetworkModel


class Builds(Protocol):
    """A plug-in that chooses among network models by its parameters. Its class, with ``Params``
    inside, stands where that of a ``NetworkModel`` does."""

    @classmethod
    def build(cls, params: Any) -> NetworkModel:
        """The model that does the work, for an instance of ``Params``."""


def model_of(cls: object, params: parameters.Params) -> NetworkModel:
    """The network model that a plug-in's class, a ``NetworkModel`` or one that ``Builds``, makes of
    its parameters."""
    # the class was checked when it was loaded
    make = cast(Callable[[parameters.Params], NetworkModel], getattr(cls, "build", cls))
    return make(params)
