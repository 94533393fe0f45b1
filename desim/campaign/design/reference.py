"""Reference designs: versioned questions to fleets, whose answers the leaderboard compares.

A vector of one is a strategy, a terrain, a network and a fleet; nothing else may vary.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

from desim import plugins
from desim.campaign.design.design import Levels, LoadedDesign
from desim.scenario.names import fleet_size
from desim.scenario.schema.scenario import Scenario

# Roles by the beginnings of keys, longer ones first.
_ROLE_OF = {"coordination.exchange.": "network", "coordination.": "strategy",
            "environment.": "terrain", "network.": "network", "middleware.": "network",
            "deployment.": "network", "fleet.": "robots"}
_BESIDE = "hosts."  # they go with what needs them, such as a strategy with a base
_VARIES = ("a parameter of a reference design sets either the terrain, the network, the robots "
           "(fleet) or the strategy")
_RANKED = "exploration"


class ReferenceDesign(NamedTuple):
    """A version of a reference design. Terrain, network, robots and strategy, its roles, each
    have ``parameters`` that vary them, or else a ``fixed`` name in all vectors."""

    name: str
    version: int
    parameters: dict[str, list[str]]
    fixed: dict[str, str]

    def names(self, levels: dict[str, str]) -> dict[str, str]:
        """The names by role of the vector with these ``levels`` of the parameters."""
        return self.fixed | {role: ", ".join(levels[name] for name in names)
                             for role, names in self.parameters.items()}


def reference_design(loaded: LoadedDesign, tasks: Iterable[str], scenario: Scenario,
                     ) -> ReferenceDesign | None:
    """The reference design that a design is, None if it is none. ``tasks`` are those of its
    vectors, ``scenario`` that of one. Raises ``InputError`` for what the leaderboard cannot show.
    """
    design = loaded.design
    if design.reference is None:
        return None
    others = [task for task in tasks if task != _RANKED]
    if others:
        raise loaded.wrong(("reference",), f"the leaderboard ranks explorations, not {others[0]}")
    parameters: dict[str, list[str]] = {}
    for name in design.parameters:
        parameters.setdefault(_role(loaded, name), []).append(name)
    terrain = scenario.environment.terrain
    names = {"terrain": terrain if isinstance(terrain, str) else scenario.name,
             "network": f"{scenario.deployment}: {' + '.join(scenario.network.media)}",
             "robots": str(fleet_size(scenario.fleet)),
             "strategy": plugins.bare(scenario.coordination.strategy)}
    return ReferenceDesign(design.name, design.reference.version, parameters, {
        role: name for role, name in names.items() if role not in parameters})


def _role(loaded: LoadedDesign, name: str) -> str:
    """The role of a parameter, by the keys that it sets."""
    shape, found = loaded.design.parameters[name], dict[str, None]()
    for key in ([key for level in shape.levels.values() for key in level]
                if isinstance(shape, Levels) else [shape.key or f"${name}"]):
        if f"{key}.".startswith(_BESIDE):
            continue
        role = next((role for begin, role in _ROLE_OF.items() if f"{key}.".startswith(begin)), None)
        if role is None:
            raise loaded.wrong(("parameters", name), f"sets {key}; {_VARIES}")
        found[role] = None
    if len(found) != 1:
        raise loaded.wrong(("parameters", name), (
            f"sets {' and '.join(found) or 'none of these'}; {_VARIES}"))
    return next(iter(found))
