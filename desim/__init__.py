"""desim: deterministic discrete-event co-simulation of robot fleets and their networks.

``desim.load(path)`` reads a scenario, ``desim.from_mapping(data)`` takes one from a mapping;
``desim.run(scenario)`` runs it and returns a ``desim.Run``; ``desim.Stepper(scenario)`` runs it
step by step; ``desim.Campaign(path)`` reads a
campaign's folder; ``desim.compare(a, b)`` puts two runs or two campaigns side by side. Notebooks
show what these return as tables and figures.
"""

from importlib import import_module
from typing import Any

from desim.compiler.folder import choose_folder
from desim.results.shown import draw_with

__version__ = "0.6.0"
__all__ = ["Campaign", "Run", "Stepper", "compare", "from_mapping", "load", "run"]

_WHERE = {"Campaign": "desim.campaign.folder.campaign", "Run": "desim.results.run",
          "Stepper": "desim.stepping.stepper", "compare": "desim.campaign.folder.comparison",
          "from_mapping": "desim.scenario.load", "load": "desim.scenario.load", "run": "desim.api"}

choose_folder()  # before anything imports numba
draw_with(lambda thing: import_module("desim.report.notebook").html_of(thing))  # when it is asked


def __getattr__(name: str) -> Any:
    # Imported when first used: ``import desim`` and ``desim --help`` stay light.
    if name in _WHERE:
        return getattr(import_module(_WHERE[name]), name)
    raise AttributeError(f"module 'desim' has no attribute {name!r}")
