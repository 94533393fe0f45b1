"""desim: deterministic discrete-event co-simulation of robot fleets and their networks.

``desim.load(path)`` reads a scenario, ``desim.from_mapping(data)`` takes one from a mapping;
``desim.run(scenario)`` runs it and returns a ``desim.Run``; ``desim.campaign(path)`` reads a
campaign's folder.
"""

from importlib import import_module
from typing import Any

from desim import compiled

__version__ = "0.1.0"
__all__ = ["Campaign", "Run", "campaign", "from_mapping", "load", "run"]

compiled.choose_folder()  # before anything imports numba


def __getattr__(name: str) -> Any:
    # Imported when first used: ``import desim`` and ``desim --help`` stay light.
    if name == "campaign":
        return import_module("desim.campaign")
    if name in __all__:
        from desim import api

        return getattr(api, name)
    raise AttributeError(f"module 'desim' has no attribute {name!r}")
